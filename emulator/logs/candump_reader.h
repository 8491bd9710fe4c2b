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

/// Reads a log as `candump -L` writes it, a line at a time; lines may end in CR LF, the last one without a
/// newline, and in the direction mark " R" or " T" of `candump -x`. Empty lines, and those that begin with
/// #, are skipped. Times are taken as they stand and need not be in order.
///
/// Read are data frames, remote frames, FD frames (their flags digit is checked, not kept) and error reports.
class CandumpReader {
 public:
  /// Throws std::runtime_error with the file and the system's reason when it cannot be opened.
  explicit CandumpReader(std::filesystem::path file);

  /// The next frame; false at the end. Throws std::runtime_error for a line that is no frame: file, line,
  /// what was found and what was expected.
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
