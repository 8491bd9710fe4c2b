#pragma once

#include <string>

#include "emulator/logs/can_log.h"

namespace walkman::bus {

/// Formats one frame as a line of `candump -L`, newline included:
/// "(0000000012.345678) can_rarm 185#3706E803\n". The time is truncated to microseconds. Remote frames end
/// in "#R" and their length if it is not 0, FD frames in "##1" (bit-rate switch) and data; the identifier of
/// an error report is its class bits combined with 20000000h.
[[nodiscard]] std::string candump_line(std::string_view interface_name, const can::StampedFrame& frame);

/// A log as text that can-utils and Wireshark read. A `note` becomes a first line that starts with #, which
/// can-utils skip and Wireshark does not understand.
class CandumpLog final : public CanLog {
 public:
  explicit CandumpLog(std::filesystem::path file, std::string_view note = {});

 private:
  void put(std::string_view interface_name, const can::StampedFrame& frame) override;

  std::string line_;
};

}  // namespace walkman::bus
