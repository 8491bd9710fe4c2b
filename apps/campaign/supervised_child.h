#pragma once

#include <string>

namespace walkman::apps {

/// How a child process ended.
struct ChildEnd {
  enum class How {
    kClean,      ///< exit code 0
    kCrashed,    ///< another exit code or a signal
    kHung,       ///< it was killed at a limit
    kKilled,     ///< SIGKILL, but not at a limit: sent by somebody, or by the system when out of memory
    kLacking,    ///< its machine lacked something (exit code 3); it has said what
    kEndedFrom,  ///< SIGTERM, SIGINT or SIGHUP: sent by whoever ends the campaign
  };
  How how = How::kClean;
  std::string text;  ///< "signal 11 (Segmentation fault)"
};

struct ChildLimits {
  double cpu = 0;   ///< s of CPU time
  double wall = 0;  ///< s
};

/// Forks. Returns true in the child, which continues with a copy-on-write copy of the parent's memory and
/// must end by `_exit`; it dies with its parent, and at its CPU time limit. Returns false in the parent once
/// the child has ended; `end` tells how. Throws EnvironmentError if no process can be created, and
/// std::logic_error if the parent has more than one thread: a child would have only one of them.
[[nodiscard]] bool fork_and_wait(const ChildLimits& limits, ChildEnd& end);

}  // namespace walkman::apps
