#pragma once

namespace walkman::apps {

/// SIGINT, SIGTERM and SIGHUP as a file descriptor instead of an end. To be made before any thread is:
/// threads inherit the blocked signals.
class StopSignals {
 public:
  /// Throws std::runtime_error when the system gives no descriptor.
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Becomes readable when a signal has come.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

  /// Whether one has come; takes no time.
  [[nodiscard]] bool arrived() noexcept;

 private:
  int descriptor_;
  bool arrived_ = false;
};

}  // namespace walkman::apps
