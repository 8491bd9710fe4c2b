#pragma once

#include "drivers/can/interface.h"

namespace walkman::can {

/// State of a controller after it has sent the report `error_frame` (linux/can/error.h); `before` when the
/// report says nothing about the state.
[[nodiscard]] LinkState link_after(const Frame& error_frame, LinkState before) noexcept;

/// The report says that the controller itself lost a received frame.
[[nodiscard]] bool tells_receive_overflow(const Frame& error_frame) noexcept;

/// "error-passive", "bus-off" and so on.
[[nodiscard]] std::string_view name_of(LinkState state) noexcept;

}  // namespace walkman::can
