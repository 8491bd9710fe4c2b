#pragma once

#include <cstdint>
#include <string>

#include "emulator/nodes/measuring/measuring_node.h"

namespace walkman::nodes {

/// Parameters of an individual load cell.
struct LoadCellParameters {
  std::uint8_t node_id = 0;
  std::string name;
  std::uint32_t serial = 0;
  double range = 2000;      ///< N
  double resolution = 0.5;  ///< N
};

/// A single-axis load cell (CiA 404, device type 00020194h): one channel, the force along the z axis of its
/// frame, in N; 7130h and 9130h in 0.1 N. TPDO1, every SYNC: 7130h:1, the sample counter 2050h:1 and the
/// status 6150h:1.
class LoadCellNode : public MeasuringNode {
 public:
  static constexpr std::uint32_t kProduct = 5;  ///< 1018h:2

  explicit LoadCellNode(const LoadCellParameters& parameters);

  /// Takes one sample, N. To be called every millisecond.
  void sample(double force) noexcept;
};

}  // namespace walkman::nodes
