#pragma once

#include "emulator/emulated_device.h"
#include "examples/load_cell/load_cell_node.h"

namespace walkman {

/// A load cell at the plant's force/torque probe number `sensor`, which measures the force along the probe's
/// z axis.
class EmulatedLoadCell final : public EmulatedDevice {
 public:
  EmulatedLoadCell(const plant::Plant& plant, int sensor, const nodes::LoadCellParameters& parameters)
      : plant_(plant), sensor_(sensor), node_(parameters) {}

  [[nodiscard]] nodes::CanopenSlave& node() noexcept override { return node_; }
  void sample() noexcept override { node_.sample(plant_.F_So_S(sensor_).force.z()); }

 private:
  const plant::Plant& plant_;
  int sensor_;
  nodes::LoadCellNode node_;
};

}  // namespace walkman
