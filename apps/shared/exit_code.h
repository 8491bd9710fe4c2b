#pragma once

#include <stdexcept>

namespace walkman::apps {

/// Exit codes of every command.
enum ExitCode : int {
  kOk = 0,           ///< ran, and the task was done
  kTaskFailed = 1,   ///< ran, but the task failed or a requested condition did not hold
  kBadInput = 2,     ///< usage or a file: one sentence on stderr
  kEnvironment = 3,  ///< the machine lacks something: an interface, a socket, a package
  kInternal = 5,     ///< a defect of the program itself
};

/// The machine lacks something that valid input requires; what() is one sentence.
class EnvironmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace walkman::apps
