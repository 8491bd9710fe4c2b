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

/// One bus as seen by a master on a kernel interface: the socket, and in lock-step the stamps of the cycle.
struct MasterBus {
  explicit MasterBus(std::unique_ptr<can::SocketCan> opened)
      : socket(std::move(opened)), restamped(*socket) {}
  std::unique_ptr<can::SocketCan> socket;
  can::RestampedInterface restamped;
};

using MasterBuses = std::vector<std::unique_ptr<MasterBus>>;

/// Paces a master in lock-step over the kernel's buses: its SYNCs are the clock. A cycle ends when everything
/// triggered by its SYNC and by the requests before it has arrived; the master's time is the number of its
/// cycles times the period.
class KernelLockstepCycle final : public Cycle {
 public:
  /// How long a cycle waits on the host's clock for missing frames; the drivers then judge. Long enough for a
  /// busy host: giving up a cycle changes the course of the run.
  static constexpr Time kLongestWait = std::chrono::seconds(2);

  /// `interrupted` is polled while waiting; true ends the run with Interrupted. All must outlive this.
  KernelLockstepCycle(Robot& robot, MasterBuses& buses, Time period, std::function<bool()> interrupted)
      : robot_(robot), buses_(buses), period_(period), interrupted_(std::move(interrupted)) {}

  Time next() override;

  /// Starts no cycle for `pause` on the host's clock, but still processes received frames.
  void hold(Time pause);

  [[nodiscard]] Time now() const { return now_; }
  /// Number of cycles in which not everything arrived.
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
/// no sooner than half a period later, so that the frames triggered by its SYNC have time to arrive.
class KernelRealTimeCycle final : public Cycle {
 public:
  /// `interrupted`: true ends the run with Interrupted. All must outlive this.
  KernelRealTimeCycle(MasterBuses& buses, Time period, std::function<bool()> interrupted);

  Time next() override;

  [[nodiscard]] Time now() const { return now_; }
  /// Number of missed grid points.
  [[nodiscard]] std::uint64_t overruns() const { return overruns_; }

 private:
  MasterBuses& buses_;
  Time period_;
  std::function<bool()> interrupted_;
  Time now_;
  std::uint64_t overruns_ = 0;
};

}  // namespace walkman::robot
