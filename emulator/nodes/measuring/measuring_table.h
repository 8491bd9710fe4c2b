#pragma once

#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

/// The objects of an analogue input's channels, a sub-index a channel (CiA 404-2): those every channel has,
/// the number of digits 6132h of those whose wire unit is a power of ten, and those of channels that may be
/// adjusted.
[[nodiscard]] ObjectTable channel_table();
[[nodiscard]] ObjectTable digits_table();
[[nodiscard]] ObjectTable adjustment_table();
/// Of the manufacturer: the sample counter of every measuring device, the temperature of a force/torque
/// sensor.
[[nodiscard]] ObjectTable sample_counter_table();
[[nodiscard]] ObjectTable sensor_temperature_table();

/// Name of an entry that stands for what the channel measures (Fx, Ty, ...).
inline constexpr std::string_view kChannelName = "Channel {}";

}  // namespace walkman::nodes
