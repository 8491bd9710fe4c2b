#include "drivers/canopen/factory_pdos.h"

#include "drivers/canopen/objects.h"

namespace walkman::canopen {
namespace {

/// All four at their predefined COB-IDs, off.
void predefine(DevicePdos& pdos) {
  for (std::size_t i = 0; i < 4; ++i) {
    pdos.receive[i].cob_id_base = static_cast<std::uint32_t>(0x200 + 0x100 * i);
    pdos.transmit[i].cob_id_base = static_cast<std::uint32_t>(0x180 + 0x100 * i);
  }
}

void enable(PdoSettings& pdo, std::uint8_t type, std::vector<MappedObject> mapping) {
  pdo.enabled = true;
  pdo.type = type;
  pdo.mapping = std::move(mapping);
}

}  // namespace

DevicePdos factory_drive_pdos(std::uint8_t n) {
  DevicePdos pdos;
  predefine(pdos);
  enable(pdos.receive[0], 255,
         {{object::kControlword, 0, 16}, {object::kMode, 0, 8}, {object::kTargetTorque, 0, 16}});
  enable(pdos.receive[1], n, {{object::kTargetPosition, 0, 32}, {object::kTargetVelocity, 0, 32}});
  enable(pdos.transmit[0], n,
         {{object::kStatusword, 0, 16}, {object::kModeDisplay, 0, 8}, {object::kTorqueActual, 0, 16}});
  enable(pdos.transmit[1], n, {{object::kPositionActual, 0, 32}, {object::kVelocityActual, 0, 32}});
  enable(pdos.transmit[3], 255,
         {{object::kErrorCode, 0, 16}, {object::kTemperatureCompact, 1, 8}, {object::kCycleCounter, 1, 16}});
  pdos.transmit[3].event_ms = 100;
  return pdos;
}

DevicePdos factory_force_torque_pdos() {
  DevicePdos pdos;
  predefine(pdos);
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  enable(pdos.transmit[0], 1,
         {{kValue, 1, 16}, {kValue, 2, 16}, {kValue, 3, 16}, {object::kCycleCounter, 1, 16}});
  enable(pdos.transmit[1], 1,
         {{kValue, 4, 16}, {kValue, 5, 16}, {kValue, 6, 16}, {object::kMeasuringStatus, 1, 8}});
  return pdos;
}

DevicePdos factory_inertial_pdos() {
  DevicePdos pdos = factory_force_torque_pdos();
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  enable(pdos.transmit[2], 1, {{kValue, 7, 16}, {kValue, 8, 16}, {kValue, 9, 16}, {kValue, 10, 16}});
  return pdos;
}

}  // namespace walkman::canopen
