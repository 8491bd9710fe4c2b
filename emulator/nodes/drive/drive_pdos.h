#pragma once

#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/nodes/drive/drive_parameters.h"

namespace walkman::nodes {

/// Factory PDO mapping of a drive ("layout A").
[[nodiscard]] CanopenSlave::PdoSet drive_rpdos(const DriveParameters& parameters);
[[nodiscard]] CanopenSlave::PdoSet drive_tpdos(const DriveParameters& parameters);

}  // namespace walkman::nodes
