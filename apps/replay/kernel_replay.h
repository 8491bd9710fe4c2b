#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "apps/replay/master_frames.h"

namespace walkman::apps {

class StopSignals;

struct KernelReplayOptions {
  std::filesystem::path log;
  std::map<std::string, std::string> interfaces;  ///< the log's interface → the kernel's
  double speed = 1;          ///< times the log's own; 0: as fast as the interfaces take it
  bool master_only = false;  ///< only what a computer sends
  GapEvent gap;              ///< told before a stretch without frames is waited through
};

struct KernelReplayResult {
  std::uint64_t sent = 0;
  std::uint64_t skipped = 0;  ///< of interfaces that were not mapped, error reports, a node's if unwanted
  std::uint64_t refused = 0;  ///< by an interface that was down or cannot carry them
  double seconds = 0;         ///< on the wall clock
  bool interrupted = false;   ///< by a signal, before the log's end
};

/// Sends the frames of a log on interfaces of the kernel, at their times. Throws std::runtime_error for a log
/// that is none, EnvironmentError for an interface that is not there. Ends early at a signal.
[[nodiscard]] KernelReplayResult replay_onto_kernel(const KernelReplayOptions& options, StopSignals& signals);

}  // namespace walkman::apps
