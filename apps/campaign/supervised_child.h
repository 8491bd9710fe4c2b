#pragma once

#include <string>

namespace walkman::apps {

/// How a child process ended.
struct ChildEnd {
  enum class How {
    kClean,      ///< exit code 0
    kCrashed,    ///< another exit code or a signal
    kHung,       ///< it was ended at a limit
    kKilled,     ///< SIGKILL, by none of the limits: somebody's, or the system's for want of memory
    kEndedFrom,  ///< SIGTERM, SIGINT or SIGHUP: whoever ends the campaign
  };
  How how = How::kClean;
  std::string text;  ///< "signal 11 (Segmentation fault)"
};

struct ChildLimits {
  double cpu = 0;   ///< s of CPU time
  double wall = 0;  ///< s
};

/// Forks. Returns true in the child, which goes on from here with all that the parent has, by copy on write,
/// and must end by `_exit`; it dies with its parent, and at the limit of its CPU time. Returns false in the
/// parent when the child has ended, which `end` then says. Throws EnvironmentError when there is no process
/// to be had, and std::logic_error when the parent has more than one thread: a child would have only the one.
[[nodiscard]] bool fork_and_wait(const ChildLimits& limits, ChildEnd& end);

}  // namespace walkman::apps
