#pragma once

#include "drivers/can/frame.h"

namespace walkman::apps {

/// Whether a frame is one that only the computer sends: NMT, SYNC, TIME, RPDOs, SDO requests, LSS requests,
/// the heartbeat of node 127 and every remote frame. By the predefined connection set (CiA 301, 7.3.5).
[[nodiscard]] bool is_from_master(const can::Frame& frame) noexcept;

}  // namespace walkman::apps
