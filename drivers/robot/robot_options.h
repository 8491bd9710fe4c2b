#pragma once

#include "drivers/robot/identities.h"
#include "drivers/robot/pdo_layout.h"
#include "drivers/time.h"

namespace walkman::robot {

/// How a robot is run; the defaults are those of the real one.
///
/// Every limit counts on the clock whose time `Robot` is given: the emulated one, or CLOCK_MONOTONIC. Tests
/// and programs change single members; the constructor of `Robot` refuses what does not fit together with the
/// device table.
struct RobotOptions {
  Time cycle = std::chrono::milliseconds(5);  ///< SYNC period
  int stale_after_cycles = 3;                 ///< cyclic data older than this many cycles is a fault
  Time heartbeat_producer =
      std::chrono::milliseconds(100);                       ///< period of the nodes' and of the own heartbeat
  Time heartbeat_timeout = std::chrono::milliseconds(250);  ///< of the nodes and of the master alike
  Time boot_timeout = std::chrono::seconds(5);              ///< for boot and for recovery
  double max_joint_velocity =
      6.0;  ///< rad/s, between consecutive set-points; the URDF's limit where it is lower
  double limit_tolerance = 0.01;  ///< rad beyond a position limit that are clamped without a fault
  PdoLayout layout = factory_layout();
  Identities identities;
  bool allow_overload = false;    ///< take a cycle that the frames of a bus do not fit into, for tests
  int sync_counter_overflow = 0;  ///< 1019h: 2 to 240, SYNC carries a counter; 0: it does not
};

}  // namespace walkman::robot
