#pragma once

#include <functional>

#include "drivers/robot/master_bus.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"

namespace walkman::apps {

/// Paces a master in lock-step over the kernel's buses: its SYNCs are the clock. A cycle ends when everything
/// has come that its SYNC and the requests before it bring about; the master's time is the number of its
/// cycles times the period.
class KernelLockstepCycle final : public robot::Cycle {
 public:
  /// How long a cycle waits on the host's clock for what does not come; the drivers then judge. Long enough
  /// for a busy host: a cycle that was given up makes the run another one.
  static constexpr Time kPatience = std::chrono::seconds(2);

  /// `interrupted` is asked while waiting; true ends the run with Interrupted. All must outlive this.
  KernelLockstepCycle(robot::Robot& robot, MasterBuses& buses, Time period, std::function<bool()> interrupted)
      : robot_(robot), buses_(buses), period_(period), interrupted_(std::move(interrupted)) {}

  Time next() override;

  [[nodiscard]] Time now() const { return now_; }
  /// Cycles in which not everything came.
  [[nodiscard]] std::uint64_t incomplete() const { return incomplete_; }

 private:
  robot::Robot& robot_;
  MasterBuses& buses_;
  Time period_;
  std::function<bool()> interrupted_;
  Time now_{};
  std::uint64_t incomplete_ = 0;
};

}  // namespace walkman::apps
