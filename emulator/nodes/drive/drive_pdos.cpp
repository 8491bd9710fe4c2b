#include "emulator/nodes/drive/drive_pdos.h"

#include "drivers/canopen/objects.h"

namespace walkman::nodes {

namespace object = canopen::object;

CanopenSlave::PdoSet drive_rpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       255,
       0,
       {mapped(object::kControlword, 0, 16), mapped(object::kMode, 0, 8),
        mapped(object::kTargetTorque, 0, 16)}},
      {true, n, 0, {mapped(object::kTargetPosition, 0, 32), mapped(object::kTargetVelocity, 0, 32)}},
      {false,
       n,
       0,
       {mapped(0x60B2, 0, 16), mapped(0x2011, 1, 16), mapped(0x2011, 2, 16),
        mapped(object::kMaxTorque, 0, 16)}},
      {false,
       n,
       0,
       {mapped(object::kControlword, 0, 16), mapped(object::kTargetPosition, 0, 32), mapped(0x60B2, 0, 16)}},
  }};
}

CanopenSlave::PdoSet drive_tpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       n,
       0,
       {mapped(object::kStatusword, 0, 16), mapped(object::kModeDisplay, 0, 8),
        mapped(object::kTorqueActual, 0, 16)}},
      {true, n, 0, {mapped(object::kPositionActual, 0, 32), mapped(object::kVelocityActual, 0, 32)}},
      {false, n, 0, {mapped(object::kAdditionalPosition, 1, 32), mapped(object::kSeriesElastic, 2, 32)}},
      {true,
       255,
       100,
       {mapped(object::kErrorCode, 0, 16), mapped(object::kTemperatureCompact, 1, 8),
        mapped(object::kCycleCounter, 1, 16)}},
  }};
}

}  // namespace walkman::nodes
