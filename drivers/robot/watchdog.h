#pragma once

#include <optional>

#include "drivers/robot/fault_record.h"

namespace walkman::canopen {
class Master;
}
namespace walkman::cia402 {
class JointDrive;
}
namespace walkman::ft {
class ForceTorqueSensor;
}
namespace walkman::imu {
class InertialUnit;
}

namespace walkman::robot {

struct SetPointLimits;

/// Judges the devices' newest states once a cycle. Each returns the first thing wrong, causes before
/// consequences: boot-up, emergency, device state, NMT state, lost heartbeat, stale data, implausible values.
/// No allocation, no exceptions.
class Watchdog {
 public:
  explicit Watchdog(const RobotOptions& options) noexcept : options_(options) {}

  [[nodiscard]] std::optional<FaultRecord> judge(const cia402::JointDrive& drive,
                                                 const SetPointLimits& limits, Time now) const noexcept;
  [[nodiscard]] std::optional<FaultRecord> judge(const ft::ForceTorqueSensor& sensor,
                                                 Time now) const noexcept;
  [[nodiscard]] std::optional<FaultRecord> judge(const imu::InertialUnit& unit, Time now) const noexcept;
  [[nodiscard]] std::optional<FaultRecord> judge(const canopen::Master& master, Time now) const noexcept;

  /// A TPDO that comes with SYNC is older than the limit.
  [[nodiscard]] std::optional<FaultRecord> stale(const canopen::RemoteNode& node, Time now) const noexcept;
  [[nodiscard]] bool heartbeat_lost(const canopen::RemoteNode& node, Time now) const noexcept;

 private:
  template <typename Sample>
  [[nodiscard]] std::optional<FaultRecord> sample_of(const canopen::RemoteNode& node, const Sample& sample,
                                                     Time now) const noexcept;
  [[nodiscard]] std::optional<FaultRecord> events(const canopen::RemoteNode& node, Time now) const noexcept;
  [[nodiscard]] std::optional<FaultRecord> supervision(const canopen::RemoteNode& node,
                                                       Time now) const noexcept;

  RobotOptions options_;
};

/// Age of data stamped `at`: `Time::max()` when there has been none, never negative.
[[nodiscard]] inline Time age_of(Time at, Time now) noexcept {
  return at == Time::min() ? Time::max() : std::max(Time{0}, now - at);
}

}  // namespace walkman::robot
