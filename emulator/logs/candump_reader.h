#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/can/frame.h"

namespace walkman::bus {

/// A frame of a log and the interface it was seen on.
struct LoggedFrame {
  std::string interface_name;
  can::StampedFrame stamped;
};

/// Reads a log in the format of `candump -L`, one line at a time. Lines may end in CR LF and in the direction
/// mark " R" or " T" of `candump -x`; the last one needs no newline. Empty lines and those that begin with #
/// are skipped. Times are taken as given and need not be in order.
///
/// Reads data frames, remote frames, FD frames (their flags digit is checked, not kept) and error reports.
class CandumpReader {
 public:
  /// Throws std::runtime_error with the file and the system's reason if it cannot be opened.
  explicit CandumpReader(std::filesystem::path file);

  /// Reads the next frame; returns false at the end. Throws std::runtime_error for a line that is not a
  /// frame, with file, line, what was found and what was expected.
  [[nodiscard]] bool next(LoggedFrame& out);

 private:
  [[nodiscard]] bool read_line();
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path file_;
  std::ifstream stream_;
  std::string line_;
  std::size_t number_ = 0;
};

}  // namespace walkman::bus
