#pragma once

#include <functional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace walkman::bench {

/// A process of this benchmark; terminated and awaited on destruction.
class ChildProcess {
 public:
  /// Runs a function in a separate process, which ends with it.
  explicit ChildProcess(const std::function<void()>& function);
  /// Runs a program; its standard output is discarded. Throws std::runtime_error if it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& line);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] bool running() const;

 private:
  pid_t pid_ = -1;
};

}  // namespace walkman::bench
