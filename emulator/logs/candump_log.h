#pragma once

#include <string>

#include "emulator/logs/can_log.h"

namespace walkman::bus {

/// One frame as a line of `candump -L`, newline included: "(0000000012.345678) can_rarm 185#3706E803\n". Time
/// is cut to microseconds. Remote frames end in "#R" and their length if not 0, FD frames in "##1" (bit-rate
/// switch) and data; an error report has its class bits under 20000000h for an identifier.
[[nodiscard]] std::string candump_line(std::string_view interface_name, const can::StampedFrame& frame);

/// A log as text that can-utils and Wireshark read. `note`, if any, is a first line with # before it, which
/// can-utils skip and Wireshark does not read.
class CandumpLog final : public CanLog {
 public:
  explicit CandumpLog(std::filesystem::path file, std::string_view note = {});

 private:
  void put(std::string_view interface_name, const can::StampedFrame& frame) override;
};

}  // namespace walkman::bus
