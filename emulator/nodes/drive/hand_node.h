#pragma once

#include <cstdint>
#include <string>

#include "emulator/nodes/drive/drive_parameters.h"

namespace walkman::nodes {

/// Travel of a hand's synergy motor from open to closed, rad.
inline constexpr double kHandTravel = 5.0;

/// The drive of an underactuated hand's one motor: a `DriveNode` with these parameters. 607Ah is the motor's
/// angle, 0 open to `kHandTravel` closed; the "spring" is the tendon, its torque that of the tendon on the
/// fingers. Pressing against an object is normal, so the following error is not watched.
[[nodiscard]] DriveParameters hand_parameters(std::uint8_t node_id, std::string name, std::uint32_t serial,
                                              double rated_torque);

}  // namespace walkman::nodes
