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
  std::map<std::string, std::string> interfaces;  ///< interface in the log → kernel interface
  double speed = 1;          ///< multiple of the log's own; 0: as fast as the interfaces accept frames
  bool master_only = false;  ///< only the frames that a computer sends
  GapEvent gap;              ///< called before waiting through a stretch without frames
};

struct KernelReplayResult {
  std::uint64_t sent = 0;
  std::uint64_t skipped = 0;  ///< on interfaces that were not mapped, error reports, unwanted frames of nodes
  std::uint64_t refused = 0;  ///< by an interface that was down or cannot carry them
  double seconds = 0;         ///< on the wall clock
  bool interrupted = false;   ///< by a signal, before the log's end
};

/// Sends the frames of a log on kernel interfaces, at their logged times. Throws std::runtime_error for an
/// invalid log, EnvironmentError for an interface that does not exist. Ends early at a signal.
[[nodiscard]] KernelReplayResult replay_onto_kernel(const KernelReplayOptions& options, StopSignals& signals);

}  // namespace walkman::apps
