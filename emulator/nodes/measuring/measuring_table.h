#pragma once

#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

/// The objects of an analogue input's channels, one sub-index per channel (CiA 404-2): those of every
/// channel, the number of digits 6132h of those whose wire unit is a power of ten, and those of adjustable
/// channels.
[[nodiscard]] ObjectTable channel_table();
[[nodiscard]] ObjectTable digits_table();
[[nodiscard]] ObjectTable adjustment_table();
/// Manufacturer-specific: the sample counter of every measuring device, the temperature of a force/torque
/// sensor.
[[nodiscard]] ObjectTable sample_counter_table();
[[nodiscard]] ObjectTable sensor_temperature_table();

/// Name of an entry that data sheets replace by the quantity that its channel measures (Fx, Ty, ...).
inline constexpr std::string_view kChannelName = "Channel {}";

}  // namespace walkman::nodes
