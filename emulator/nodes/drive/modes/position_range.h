#pragma once

#include <cstdint>

#include "emulator/nodes/drive/modes/operating_mode.h"

namespace walkman::nodes {

/// A position target within 607Dh.
struct RangedTarget {
  double position = 0;  ///< rad, motor encoder's coordinates
  std::int32_t wire = 0;
  bool limited = false;
};

/// `target` in urad as on the wire.
[[nodiscard]] RangedTarget within_range(const MotionContext& context, std::int64_t target) noexcept;

/// A velocity demand from which the motor still stops before a limit 607Dh with the deceleration 6085h,
/// rad/s.
[[nodiscard]] double stopping_in_range(const MotionContext& context, double velocity) noexcept;

/// How far the motor is beyond its range, rad: positive above, negative below, 0 inside.
[[nodiscard]] double out_of_range(const MotionContext& context) noexcept;

}  // namespace walkman::nodes
