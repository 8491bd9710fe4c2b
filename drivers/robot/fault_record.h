#pragma once

#include <cstdint>
#include <string>

#include "drivers/robot/robot.h"

namespace walkman::canopen {
class RemoteNode;
}

namespace walkman::robot {

/// What a fault's sentence is about, finer than `FaultKind`.
enum class FaultDetail {
  kNoTpdo,        ///< `number` the TPDO, `a` age and `b` limit in s; a negative age: none ever
  kCounterStuck,  ///< `number` the counter, `a` how long in s
  kHeartbeat,     ///< `a` age and `b` limit in s
  kBootUp,
  kNmtState,       ///< `number` the state
  kDriveState,     ///< `number` statusword | error code << 16
  kEmergency,      ///< `number` code | error register << 16
  kSensorStatus,   ///< `number` 6150h
  kOutOfRange,     ///< a raw value at an end of its range
  kPositionRange,  ///< `a` position in rad, `b` the limit it passed
  kPositionStep,   ///< `a` step in rad
  kCommandNotFinite,
  kCommandLimit,  ///< `a` command in rad, `b` the limit
  kCommandCount,  ///< `number` given, `a` expected
  kNoSuchHand,    ///< `number` the hand, `a` how many there are
  kRequest,       ///< failed SDO: `number` index << 8 | sub, `code` the abort code
  kInterfaceDown,
  kQueueFull,  ///< `number` of cycles
  kFrameRefused,
  kBusOff,
  kReceiveOverflow,  ///< `number` of frames
};

/// A fault as the cycle writes it down: numbers only, so that nothing is allocated; `describe` makes it
/// words.
struct FaultRecord {
  FaultKind kind{};
  FaultDetail detail{};
  const canopen::RemoteNode* node = nullptr;  ///< null: the interface itself
  const can::Interface* interface = nullptr;
  Time time{};
  std::uint32_t number = 0;
  std::uint32_t code = 0;
  double a = 0;
  double b = 0;
};

[[nodiscard]] Fault describe(const FaultRecord& record);

}  // namespace walkman::robot
