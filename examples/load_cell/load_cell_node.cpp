#include "examples/load_cell/load_cell_node.h"

#include <array>

#include "drivers/canopen/objects.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kNewton = 0x00210000;    // CiA 303-2
constexpr std::uint16_t kForceSensor = 10000;    // 6110h, in the manufacturer's range
constexpr std::uint32_t kSamplePeriodUs = 1000;  // 6114h

std::array<ChannelDescription, 1> describe(const LoadCellParameters& p) {
  return {{{p.range, p.resolution, 0.1, kForceSensor, kNewton, std::uint8_t{1}, false}}};
}

}  // namespace

LoadCellNode::LoadCellNode(const LoadCellParameters& parameters)
    : MeasuringNode({parameters.node_id, kAnalogueInputType, parameters.name, kProduct, parameters.serial},
                    describe(parameters), kSamplePeriodUs) {
  PdoSet transmit;
  transmit[0] = {true,
                 1,
                 0,
                 {mapped(object::kProcessValueInt16, 1, 16), mapped(object::kCycleCounter, 1, 16),
                  mapped(object::kMeasuringStatus, 1, 8)}};
  configure_pdos({}, transmit);
}

void LoadCellNode::sample(double force) noexcept { take_sample(std::array{force}); }

}  // namespace walkman::nodes
