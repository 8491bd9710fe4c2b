#pragma once

#include <functional>

#include "drivers/robot/master_bus.h"
#include "drivers/robot/cycle.h"

namespace walkman::apps {

/// Paces a master by the host's clock: cycles begin on a fixed grid of CLOCK_MONOTONIC, which is also the
/// clock of the frames' stamps. A cycle that took too long is counted; the next one begins on the grid again,
/// no sooner than half a period later, so that what its SYNC brings about has time to come.
class KernelRealTimeCycle final : public robot::Cycle {
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

}  // namespace walkman::apps
