#pragma once

namespace walkman::apps {

/// Exit codes of every command.
enum ExitCode : int {
  kOk = 0,          ///< ran, and the task was done
  kTaskFailed = 1,  ///< ran, but the task failed or a gate was not met
  kBadInput = 2,    ///< usage or a file: one sentence on stderr
  kInternal = 5,    ///< a defect of the program itself
};

}  // namespace walkman::apps
