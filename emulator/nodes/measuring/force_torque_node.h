#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "emulator/nodes/measuring/force_torque_transducer.h"
#include "emulator/nodes/measuring/measuring_node.h"
#include "emulator/nodes/measuring/reading_fault.h"
#include "urdf/reader/wrench.h"

namespace walkman::nodes {

/// One channel of a force/torque sensor: full scale and effective resolution, in N or N·m.
struct ChannelRating {
  double range = 0;       ///< infinity: none
  double resolution = 0;  ///< 0: none
};

/// Hardware of a six-axis force/torque sensor; channels Fx, Fy, Fz, Tx, Ty, Tz. The default ratings are those
/// of IIT's 45 mm sensor, with a transducer that adds no errors.
struct ForceTorqueParameters {
  std::uint8_t node_id = 0;
  std::string name;
  std::uint32_t serial = 0;
  std::array<ChannelRating, 6> channels{
      {{1500, 0.25}, {1500, 0.25}, {2000, 0.25}, {35, 0.005}, {35, 0.005}, {25, 0.004}}};
  std::uint32_t sample_period_us = 1000;  ///< 6114h
  TransducerParameters transducer;
};

/// A six-axis force/torque sensor (CiA 404, device type 00020194h). Sub-index = channel, Fx Fy Fz Tx Ty Tz,
/// in N and N·m; 7130h and 9130h in 0.1 N and 0.01 N·m.
///
/// A sample passes through the `ForceTorqueTransducer`, then each component through its `AnalogueChannel`.
/// TPDO1: 7130h:1-3 and the sample counter 2050h:1; TPDO2: 7130h:4-6 and the status 6150h:1; every SYNC.
/// 2034h:1 is the sensor's temperature in 0.1 degC.
class ForceTorqueNode : public MeasuringNode {
 public:
  static constexpr std::size_t kChannels = 6;

  explicit ForceTorqueNode(const ForceTorqueParameters& parameters);

  /// Takes one sample: the load on the sensor, about and in the sensor frame S. To be called every sample
  /// period. A value that is not finite makes its channel invalid; its last value stays.
  void sample(const Wrench& F_So_S) noexcept;

  /// Makes a fault of the transducer's readings that has no effect until it is added to `faults`.
  [[nodiscard]] ReadingFault make_fault(const ReadingFault::Parameters& parameters) const;
  [[nodiscard]] ReadingFaults& faults() noexcept { return faults_; }

 private:
  ForceTorqueTransducer transducer_;
  double sample_period_;  // s
  ReadingFaults faults_;
  Object<std::int16_t> temperature_;
};

}  // namespace walkman::nodes
