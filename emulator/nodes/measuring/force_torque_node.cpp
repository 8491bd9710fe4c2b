#include "emulator/nodes/measuring/force_torque_node.h"

#include "drivers/canopen/objects.h"
#include "emulator/nodes/measuring/measuring_table.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kForceTorqueProduct = 2;
constexpr double kForceUnit = 0.1;    // N, of 7130h
constexpr double kTorqueUnit = 0.01;  // N·m

// CiA 303-2: 21h is newton. We know of no separate code for the newton metre; 23h is the joule, which has the
// same dimension.
constexpr std::uint32_t kNewton = 0x00210000;
constexpr std::uint32_t kNewtonMetre = 0x00230000;
constexpr std::uint16_t kForceSensor = 10000;   // 6110h, in the manufacturer's range
constexpr std::uint16_t kTorqueSensor = 10001;  // 6110h, in the manufacturer's range

std::array<ChannelDescription, ForceTorqueNode::kChannels> describe(const ForceTorqueParameters& parameters) {
  const ChannelDescription force{0, 0, kForceUnit, kForceSensor, kNewton, std::uint8_t{1}, true};
  const ChannelDescription torque{0, 0, kTorqueUnit, kTorqueSensor, kNewtonMetre, std::uint8_t{2}, true};
  std::array<ChannelDescription, ForceTorqueNode::kChannels> channels{force,  force,  force,
                                                                      torque, torque, torque};
  for (std::size_t i = 0; i < channels.size(); ++i) {
    channels[i].range = parameters.channels[i].range;
    channels[i].resolution = parameters.channels[i].resolution;
  }
  return channels;
}

Vector6 wire_units() {
  Vector6 units;
  units << kForceUnit, kForceUnit, kForceUnit, kTorqueUnit, kTorqueUnit, kTorqueUnit;
  return units;
}

std::int16_t wire_temperature(const ForceTorqueTransducer& transducer) {
  return to_wire<std::int16_t>(transducer.temperature_c(), kDeci);
}

}  // namespace

ForceTorqueNode::ForceTorqueNode(const ForceTorqueParameters& parameters)
    : MeasuringNode(
          {parameters.node_id, kAnalogueInputType, parameters.name, kForceTorqueProduct, parameters.serial},
          describe(parameters), parameters.sample_period_us),
      transducer_(parameters.transducer, parameters.sample_period_us * kMicro),
      sample_period_(parameters.sample_period_us * kMicro) {
  objects().add(sensor_temperature_table());
  temperature_ =
      objects().object<std::int16_t>(object::kSensorTemperature, 1).factory(wire_temperature(transducer_));
  configure_pdos({}, vector_tpdos());
}

ReadingFault ForceTorqueNode::make_fault(const ReadingFault::Parameters& parameters) const {
  return {parameters, wire_units(), sample_period_};
}

void ForceTorqueNode::sample(const Wrench& F_So_S) noexcept {
  const Vector6 measured = faults_.apply(transducer_.measure(F_So_S));
  std::array<double, kChannels> readings{};
  for (std::size_t i = 0; i < kChannels; ++i) readings[i] = measured[static_cast<Eigen::Index>(i)];
  temperature_.set(wire_temperature(transducer_));
  take_sample(readings);
}

}  // namespace walkman::nodes
