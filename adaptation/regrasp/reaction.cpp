#include "adaptation/regrasp/reaction.h"

namespace walkman::regrasp {
namespace {

/// Recovered from is what a device, a bus or a link has lost and may have again. What was commanded, computed
/// or measured wrong would come again.
bool recoverable(robot::FaultKind kind) noexcept {
  using enum robot::FaultKind;
  switch (kind) {
    case kBusOff:
    case kReceiveOverflow:
    case kBusSilent:
    case kUnexpectedBootUp:
    case kEmergency:
    case kDriveFault:
    case kNmtState:
    case kHeartbeatLost:
    case kDataStale:
    case kSensorInvalid:
      return true;
    case kInterfaceDown:  // of the host: somebody took it away
    case kBusFlooded:
    case kCycleLate:
    case kNotFinite:
    case kNotFollowing:
    case kLimit:
    case kRequestFailed:
      return false;
  }
  return false;
}

}  // namespace

Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept {
  // A boot would let go of what the drives carry.
  return recoverable(kind) && !holding ? Reaction::kRecover : Reaction::kStop;
}

}  // namespace walkman::regrasp
