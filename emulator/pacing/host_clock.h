#pragma once

#include "drivers/time.h"

namespace walkman::clock {

/// CLOCK_MONOTONIC of the machine the emulator runs on. Nothing outside this folder asks for it.
[[nodiscard]] Time host_now() noexcept;

}  // namespace walkman::clock
