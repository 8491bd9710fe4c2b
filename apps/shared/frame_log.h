#pragma once

#include <filesystem>
#include <memory>

#include "emulator/emulator.h"
#include "emulator/logs/can_log.h"

namespace walkman::apps {

/// Everything the emulated buses carry, written to a file as it passes.
class FrameLog {
 public:
  /// Creates the file, `.log` or `.pcapng`. Throws std::runtime_error for another ending or a path that
  /// cannot be written. `emulator` must outlive the log.
  FrameLog(const std::filesystem::path& file, Emulator& emulator);

  /// Writes what has passed, in order of time. To be called when all buses have reached one instant.
  void commit() { log_->commit(); }
  /// Throws std::runtime_error when any of it could not be written.
  void finish() { log_->flush(); }

 private:
  std::unique_ptr<bus::CanLog> log_;
};

}  // namespace walkman::apps
