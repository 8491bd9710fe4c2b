#pragma once

#include <chrono>

namespace walkman {

/// Time since an arbitrary but fixed origin. On an emulated robot this is the emulated clock, on a real one
/// CLOCK_MONOTONIC.
using Time = std::chrono::nanoseconds;

}  // namespace walkman
