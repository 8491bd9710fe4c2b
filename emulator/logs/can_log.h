#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::bus {

/// Marks a frame as a controller's error report in the files' identifiers (CAN_ERR_FLAG of linux/can.h).
inline constexpr std::uint32_t kErrorFlag = 0x20000000;

/// A log file of the frames of one or more buses, in order of time. Times are on the emulated clock; a
/// frame's time is the end of its last bit.
class CanLog {
 public:
  virtual ~CanLog() = default;
  CanLog(const CanLog&) = delete;
  CanLog& operator=(const CanLog&) = delete;

  /// Adds a frame, or a controller's error report, to the current batch. `interface_name` must stay valid
  /// until `commit`.
  void write(std::string_view interface_name, const can::StampedFrame& frame) {
    batch_.push_back({interface_name, frame});
  }

  /// Writes the batch in order of time, frames of equal time in the order they were added. To be called when
  /// every bus has reached the same instant, so that the whole file is in order. Does not report errors;
  /// `flush` does.
  void commit();

  /// Commits and flushes everything to the file. Throws std::runtime_error if anything so far could not be
  /// written.
  void flush();

 protected:
  /// Number of characters of a note that are kept: can-utils read lines of up to 400.
  static constexpr std::size_t kLongestNote = 300;

  /// Creates or truncates the file. Throws std::runtime_error with the file and the system's reason.
  explicit CanLog(std::filesystem::path file);

  virtual void put(std::string_view interface_name, const can::StampedFrame& frame) = 0;
  [[nodiscard]] std::ostream& stream() noexcept { return stream_; }

 private:
  struct Record {
    std::string_view interface_name;
    can::StampedFrame frame;
  };

  std::filesystem::path file_;
  std::vector<char> file_buffer_;  // outlives the stream, which uses it
  std::ofstream stream_;
  std::vector<Record> batch_;
  std::vector<std::pair<Time, std::size_t>> order_;  // by time, then by position in the batch
};

/// Opens a log of the format given by the file's suffix: ".log" for the text of `candump -L`, ".pcapng" for a
/// Wireshark capture. `note`: one line for the head of the log; omitted if empty. Throws std::runtime_error
/// for any other suffix, or if the file cannot be created.
[[nodiscard]] std::unique_ptr<CanLog> open_can_log(const std::filesystem::path& file,
                                                   std::string_view note = {});

}  // namespace walkman::bus
