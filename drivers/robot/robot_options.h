#pragma once

#include "drivers/robot/identities.h"
#include "drivers/robot/pdo_layout.h"
#include "drivers/time.h"

namespace walkman::robot {

/// How a robot is operated; the defaults are those of the real one.
///
/// Every limit refers to the clock whose time `Robot` is given: the emulated one, or CLOCK_MONOTONIC. Tests
/// and programs change single members; the constructor of `Robot` rejects options that do not fit the device
/// table.
struct RobotOptions {
  Time cycle = std::chrono::milliseconds(5);  ///< SYNC period
  int stale_after_cycles = 3;                 ///< cyclic data older than this many cycles is a fault
  Time heartbeat_producer = std::chrono::milliseconds(100);  ///< heartbeat period of nodes and master
  Time heartbeat_timeout = std::chrono::milliseconds(250);   ///< for the nodes and the master alike
  Time boot_timeout = std::chrono::seconds(5);               ///< for boot and for recovery
  /// Fastest set-points: difference of consecutive ones over their interval, rad/s; the URDF's limit if that
  /// is lower.
  double max_joint_velocity = 6.0;
  double limit_tolerance = 0.01;  ///< rad beyond a position limit that are clamped without a fault
  PdoLayout layout = factory_layout();
  Identities identities;
  bool allow_overload = false;    ///< accept a cycle into which the frames of a bus do not fit, for tests
  int sync_counter_overflow = 0;  ///< 1019h: 2 to 240: SYNC carries a counter; 0: it does not
};

}  // namespace walkman::robot
