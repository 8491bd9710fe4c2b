#pragma once

namespace walkman::apps {

/// SIGINT, SIGTERM and SIGHUP as a file descriptor instead of a termination. To be created before any thread:
/// threads inherit the blocked signals.
class StopSignals {
 public:
  /// Throws std::runtime_error if the system provides no descriptor.
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Becomes readable when a signal has arrived.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

  /// Returns whether a signal has arrived; does not block.
  [[nodiscard]] bool arrived() noexcept;

 private:
  int descriptor_;
  bool arrived_ = false;
};

}  // namespace walkman::apps
