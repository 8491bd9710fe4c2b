#pragma once

#include "drivers/can/interface.h"

namespace walkman::can {

/// An interface whose received frames carry the time of the master's cycle instead of their original stamp.
///
/// In lock-step over the kernel's bus, a frame's receive stamp is wall-clock time, which is unrelated to
/// emulated time and differs from run to run; the cycle's time is the same in every run. Everything else is
/// forwarded to the wrapped interface.
class RestampedInterface final : public Interface {
 public:
  /// `inner` must outlive this.
  explicit RestampedInterface(Interface& inner) noexcept : inner_(&inner) {}

  /// Sets the stamp of every frame received from now on.
  void set_time(Time time) noexcept { time_ = time; }

  [[nodiscard]] SendResult send(const Frame& frame) noexcept override { return inner_->send(frame); }
  void flush() noexcept override { inner_->flush(); }
  [[nodiscard]] LinkState link() const noexcept override { return inner_->link(); }
  [[nodiscard]] bool receive(StampedFrame& out) noexcept override {
    if (!inner_->receive(out)) return false;
    out.time = time_;
    return true;
  }
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override {
    return inner_->receive_overflows();
  }
  [[nodiscard]] std::string_view name() const noexcept override { return inner_->name(); }

 private:
  Interface* inner_;
  Time time_{};
};

}  // namespace walkman::can
