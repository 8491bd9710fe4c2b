#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/cia402/words.h"

namespace walkman::cia402 {

/// The controlword that brings a drive in `state` one transition nearer to operation enabled (CiA 402-2,
/// state machine). In the fault state it alternates with `last`, because fault reset acts on bit 7's rising
/// edge only.
[[nodiscard]] std::uint16_t next_controlword(State state, std::uint16_t last) noexcept;

/// The standard's name, e.g. "switch on disabled".
[[nodiscard]] std::string_view name_of(State state) noexcept;

}  // namespace walkman::cia402
