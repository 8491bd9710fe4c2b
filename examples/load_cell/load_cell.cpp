#include "examples/load_cell/load_cell.h"

#include "drivers/canopen/objects.h"

namespace walkman::cia404 {

namespace object = canopen::object;

LoadCell::LoadCell(const canopen::NodeSettings& settings) : MeasuringDevice(settings, kChannels) {
  set_measuring_steps({});
}

bool LoadCell::decode(const ChannelSample& channels) noexcept {
  sample_.force = channels.raw(0) * 0.1;
  return true;
}

canopen::DevicePdos LoadCell::factory_pdos() {
  canopen::DevicePdos pdos = canopen::predefined_pdos();
  enable(pdos.transmit[0], 1,
         {{object::kProcessValueInt16, 1, 16},
          {object::kCycleCounter, 1, 16},
          {object::kMeasuringStatus, 1, 8}});
  return pdos;
}

}  // namespace walkman::cia404
