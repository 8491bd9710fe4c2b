#pragma once

#include <memory>
#include <vector>

#include "drivers/canopen/cob_id.h"
#include "drivers/robot/robot_bus.h"

namespace walkman::robot {

/// Brings buses into operation, one cycle at a time: NMT reset communication, configuration of all nodes at
/// the same time, NMT start, power-up of the drives. A boot does this for every bus; a recovery does it for
/// the buses that lost something, and on the others brings drives that left operation enabled back to it,
/// while everything else holds.
class Boot {
 public:
  /// Both must outlive this.
  Boot(std::vector<std::unique_ptr<RobotBus>>& buses, const RobotOptions& options)
      : buses_(buses), options_(options) {}

  /// Starts booting all buses from the beginning.
  void begin(Time now);
  /// Starts recovering what has failed. Received frames must have been processed before. `own_delay`: data
  /// are old because this computer was late; they are then no reason to reboot a bus, and it is enough to
  /// wait for new ones.
  void begin_recovery(Time now, bool own_delay);

  /// Performs one cycle, before its frames are sent and after received frames have been processed; `syncs`:
  /// number of SYNCs sent. Returns true once everything is in operation.
  /// Throws std::runtime_error with node and reason if something does not come up within the boot time-out.
  [[nodiscard]] bool step(Time now, std::uint64_t syncs);
  /// Aborts the boot or recovery under way.
  void abandon() noexcept { phase_ = Phase::kNone; }

  [[nodiscard]] bool under_way() const noexcept { return phase_ != Phase::kNone; }
  [[nodiscard]] bool recovering() const noexcept { return under_way() && recovering_; }
  /// Whether the set-points of a bus are sent in this cycle.
  [[nodiscard]] bool drives(const RobotBus& bus) const noexcept {
    return phase_ == Phase::kPoweringUp || (recovering() && !bus.reset);
  }

 private:
  enum class Phase { kNone, kResetting, kConfiguring, kStarting, kPoweringUp };

  void begin_reset(RobotBus& bus, Time now);
  [[nodiscard]] static bool needs_reset(const RobotBus& bus, Time now, bool own_delay) noexcept;
  [[nodiscard]] bool command_all(canopen::NmtCommand command) noexcept;
  [[nodiscard]] bool configure_all(Time now);
  void begin_power_up() noexcept;
  [[nodiscard]] bool power_up_all(Time now, std::uint64_t syncs);
  void finish() noexcept;
  void check_links(Time now);
  void check_progress(Time now) const;
  void check_the_others(Time now) const;
  [[noreturn]] void fail(Time now) const;

  std::vector<std::unique_ptr<RobotBus>>& buses_;
  const RobotOptions& options_;
  Phase phase_ = Phase::kNone;
  bool recovering_ = false;
  Time began_{};
};

}  // namespace walkman::robot
