#pragma once

#include "drivers/canopen/pdo_settings.h"

/// Factory mappings of the robot's devices, layout A of docs/protocol.md: what a node has after NMT reset
/// when nobody writes anything to it.
namespace walkman::canopen {

/// `sync_divider`: the synchronous PDOs travel with every n-th SYNC.
[[nodiscard]] DevicePdos factory_drive_pdos(std::uint8_t sync_divider);
[[nodiscard]] DevicePdos factory_force_torque_pdos();
[[nodiscard]] DevicePdos factory_inertial_pdos();

}  // namespace walkman::canopen
