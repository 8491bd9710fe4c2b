#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "apps/replay/master_frames.h"
#include "apps/shared/emulated_world.h"

namespace walkman::apps {

struct ReplayOptions {
  std::filesystem::path log;
  WorldOptions world;
  std::map<std::string, std::string> interfaces;  ///< interface name in the log → bus name
  GapEvent gap;  ///< called before a stretch without frames is emulated, which may take long
};

/// Comparison of the nodes' answers with those in the log: the n-th answer with an identifier on a bus is
/// compared with the n-th in the log.
struct ReplayResult {
  std::uint64_t given = 0;      ///< frames of the master that were played
  std::uint64_t equal = 0;      ///< answers with the same bytes
  std::uint64_t different = 0;  ///< answers with other bytes
  std::uint64_t missing = 0;    ///< in the log only
  std::uint64_t extra = 0;      ///< in the replay only
  Time latest{};                ///< largest difference in time between equal answers
  std::string first;            ///< the first difference, human-readable; empty if there is none
  double seconds = 0;           ///< emulated

  [[nodiscard]] bool same() const { return different == 0 && missing == 0 && extra == 0; }
};

/// Plays the computer's frames from a log to a freshly powered-on emulated robot on the embedded bus, and
/// compares the robot's answers. Each frame is offered to the bus in time to begin when it began in the log.
/// Throws std::runtime_error for an invalid log or scene: file, line, what was found.
[[nodiscard]] ReplayResult replay_into_emulator(const ReplayOptions& options);

}  // namespace walkman::apps
