#pragma once

#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/nodes/drive/drive_parameters.h"

namespace walkman::nodes {

/// The application objects of a drive: CiA 402-2 and the manufacturer area 2xxxh.
[[nodiscard]] ObjectTable drive_table();

/// Factory PDO mapping of a drive ("layout A"). PDOs that are off map nothing, because some masters bind an
/// object to the last PDO that maps it, whether on or off.
[[nodiscard]] CanopenSlave::PdoSet drive_rpdos(const DriveParameters& parameters);
[[nodiscard]] CanopenSlave::PdoSet drive_tpdos(const DriveParameters& parameters);

}  // namespace walkman::nodes
