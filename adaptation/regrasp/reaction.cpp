#include "adaptation/regrasp/reaction.h"

#include <algorithm>
#include <array>

namespace walkman::regrasp {
namespace {

using enum robot::FaultKind;
using enum Reaction;

struct FaultReaction {
  robot::FaultKind kind{};
  Reaction empty_handed{}, holding{};
};

// Recovered from is what a device, a bus or a link has lost and may have again. What was commanded, computed
// or measured wrong would come again, and an interface of the host does not go away by itself. With an object
// in the hand a boot would let go of what the drives carry.
constexpr std::array kReactions = {
    FaultReaction{kBusOff, kRecover, kStop},           FaultReaction{kInterfaceDown, kStop, kStop},
    FaultReaction{kReceiveOverflow, kRecover, kStop},  FaultReaction{kBusFlooded, kStop, kStop},
    FaultReaction{kBusSilent, kRecover, kStop},        FaultReaction{kCycleLate, kStop, kStop},
    FaultReaction{kUnexpectedBootUp, kRecover, kStop}, FaultReaction{kEmergency, kRecover, kStop},
    FaultReaction{kDriveFault, kRecover, kStop},       FaultReaction{kNmtState, kRecover, kStop},
    FaultReaction{kHeartbeatLost, kRecover, kStop},    FaultReaction{kDataStale, kRecover, kStop},
    FaultReaction{kSensorInvalid, kRecover, kStop},    FaultReaction{kNotFinite, kStop, kStop},
    FaultReaction{kNotFollowing, kStop, kStop},        FaultReaction{kLimit, kStop, kStop},
    FaultReaction{kRequestFailed, kStop, kStop},
};

}  // namespace

Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept {
  const auto* row = std::find_if(kReactions.begin(), kReactions.end(),
                                 [kind](const FaultReaction& one) { return one.kind == kind; });
  if (row == kReactions.end()) return kStop;
  return holding ? row->holding : row->empty_handed;
}

}  // namespace walkman::regrasp
