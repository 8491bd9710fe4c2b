#pragma once

#include <array>
#include <cstdint>

/// Codes of 603Fh and EMCY that the drive's control finds itself; those of its measurements are in
/// `Supervision`, those of its communication in `CanopenSlave`.
namespace walkman::nodes::drive_fault {

inline constexpr std::uint16_t kBlocked = 0x7121;
inline constexpr std::uint16_t kCommunication = 0x8100;
inline constexpr std::uint16_t kHeartbeatLost = 0x8130;
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;
inline constexpr std::uint16_t kFollowingError = 0x8611;
inline constexpr std::uint16_t kPositionLimit = 0x8612;

/// Those that are over once the torque is off.
inline constexpr std::array<std::uint16_t, 4> kOverWithoutTorque{kBlocked, kCommunication, kFollowingError,
                                                                 kPositionLimit};

}  // namespace walkman::nodes::drive_fault
