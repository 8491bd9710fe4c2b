#pragma once

#include <chrono>
#include <functional>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::apps {

/// Called for a stretch of a log without frames that is longer than `kLongGap`; both times are the log's.
using GapEvent = std::function<void(Time from, Time until)>;

constexpr Time kLongGap = std::chrono::seconds(2);

/// Returns whether a frame is one that only the computer sends: NMT, SYNC, TIME, RPDOs, SDO requests, LSS
/// requests, the heartbeat of node 127 and every remote frame. By the predefined connection set (CiA 301,
/// 7.3.5).
[[nodiscard]] bool is_from_master(const can::Frame& frame) noexcept;

}  // namespace walkman::apps
