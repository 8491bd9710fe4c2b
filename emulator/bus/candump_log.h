#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/can/frame.h"

namespace walkman::bus {

/// One frame as a line of `candump -L`, newline included: "(0000000012.345678) can_rarm 185#3706E803\n". Time
/// is cut to microseconds, remote frames end in "#R" and their length if not 0, FD frames in "##0" and data.
[[nodiscard]] std::string candump_line(std::string_view interface_name, const can::StampedFrame& frame);

/// Writes the frames of one or more buses to a text file that can-utils and Wireshark read. Times are those
/// of the emulated clock.
class CandumpLog {
 public:
  /// Creates or truncates the file. Throws std::runtime_error with the file and the system's reason.
  explicit CandumpLog(std::filesystem::path file);

  /// Adds a frame to the present batch. `interface_name` must stay valid until `commit`.
  void write(std::string_view interface_name, const can::StampedFrame& frame) {
    batch_.push_back({interface_name, frame});
  }

  /// Writes the batch in order of time; frames of the same time in the order they came. To be called when
  /// every bus has reached the same instant, so that the whole file is in order. Does not report errors:
  /// `flush` does.
  void commit();

  /// Commits and brings everything to the file. Throws std::runtime_error when anything so far could not be
  /// written.
  void flush();

 private:
  struct Record {
    std::string_view interface_name;
    can::StampedFrame frame;
  };

  std::filesystem::path file_;
  std::ofstream stream_;
  std::vector<Record> batch_;
  std::vector<std::pair<Time, std::size_t>> order_;  // by time, then by place in the batch
};

}  // namespace walkman::bus
