#pragma once

#include <string>

#include "emulator/logs/can_log.h"

namespace walkman::bus {

/// A log as a pcapng capture that Wireshark and tshark read: link type 227 (SocketCAN), one interface block
/// per bus with its name, times in nanoseconds. An interface's block precedes its first frame. A `note`
/// becomes the section's comment.
class PcapngLog final : public CanLog {
 public:
  explicit PcapngLog(std::filesystem::path file, std::string_view note = {});

 private:
  void put(std::string_view interface_name, const can::StampedFrame& frame) override;
  [[nodiscard]] std::uint32_t interface_number(std::string_view name);

  std::vector<std::string> interfaces_;
};

}  // namespace walkman::bus
