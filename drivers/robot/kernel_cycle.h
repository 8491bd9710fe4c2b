#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/can/restamped_interface.h"
#include "drivers/can/socket_can.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"

namespace walkman::robot {

/// One bus as a master on a kernel's interface sees it: the socket, and in lock-step the stamps of the cycle.
struct MasterBus {
  explicit MasterBus(std::unique_ptr<can::SocketCan> opened)
      : socket(std::move(opened)), restamped(*socket) {}
  std::unique_ptr<can::SocketCan> socket;
  can::RestampedInterface restamped;
};

using MasterBuses = std::vector<std::unique_ptr<MasterBus>>;

/// Paces a master in lock-step over the kernel's buses: its SYNCs are the clock. A cycle has ended when
/// everything has come that its SYNC and the requests before it bring about; the master's time is the number
/// of its cycles times the period.
class KernelLockstepCycle final : public Cycle {
 public:
  /// How long a cycle waits on the host's clock for what does not come; the drivers then judge. Long enough
  /// for a busy host: a cycle that was given up makes the run another one.
  static constexpr Time kLongestWait = std::chrono::seconds(2);

  /// `interrupted` is asked while waiting; true ends the run with Interrupted. All must outlive this.
  KernelLockstepCycle(Robot& robot, MasterBuses& buses, Time period, std::function<bool()> interrupted)
      : robot_(robot), buses_(buses), period_(period), interrupted_(std::move(interrupted)) {}

  Time next() override;

  /// Begins no cycle for as long as `pause` on the host's clock, and takes in what comes nevertheless.
  void hold(Time pause);

  [[nodiscard]] Time now() const { return now_; }
  /// Cycles in which not everything came.
  [[nodiscard]] std::uint64_t incomplete() const { return incomplete_; }

 private:
  void await_frames(Time limit);

  Robot& robot_;
  MasterBuses& buses_;
  Time period_;
  std::function<bool()> interrupted_;
  Time now_{};
  std::uint64_t incomplete_ = 0;
};

/// Paces a master by the host's clock: cycles begin on a fixed grid of CLOCK_MONOTONIC, which is also the
/// clock of the frames' stamps. A cycle that took too long is counted; the next one begins on the grid again,
/// no sooner than half a period later, so that what its SYNC brings about has time to come.
class KernelRealTimeCycle final : public Cycle {
 public:
  /// `interrupted`: true ends the run with Interrupted. All must outlive this.
  KernelRealTimeCycle(MasterBuses& buses, Time period, std::function<bool()> interrupted);

  Time next() override;

  [[nodiscard]] Time now() const { return now_; }
  /// Grid points that were missed.
  [[nodiscard]] std::uint64_t overruns() const { return overruns_; }

 private:
  MasterBuses& buses_;
  Time period_;
  std::function<bool()> interrupted_;
  Time now_;
  std::uint64_t overruns_ = 0;
};

}  // namespace walkman::robot
