#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman {

/// A robot's links grouped by what they belong to: hands, kinematic chains, feet.
class RobotParts {
 public:
  /// Everything below a force/torque sensor's frame.
  struct Hand {
    std::string frame;                   ///< of the sensor
    std::vector<std::size_t> mountings;  ///< joints below the frame
    std::vector<std::size_t> links;      ///< all links below, without the frame's own
  };

  RobotParts(const RobotModel& robot, const DeviceTable& devices);

  [[nodiscard]] const std::vector<Hand>& hands() const { return hands_; }
  /// The links that carry a force/torque sensor with nothing below it; they have the soles.
  [[nodiscard]] const std::vector<std::size_t>& feet() const { return feet_; }
  /// Links of chains: all except the hands'.
  [[nodiscard]] const std::vector<std::size_t>& chain_links() const { return chain_links_; }
  /// The first link of a link's chain. A chain is a series of bodies that move relative to each other, up to
  /// where more than one body is attached to another. Links fixed to a body belong to it.
  [[nodiscard]] std::size_t chain(std::size_t link) const { return chain_[link]; }
  /// Joints that a joint drive moves, in the order of the device table.
  [[nodiscard]] const std::vector<std::string>& driven_joints() const { return driven_; }

 private:
  std::vector<Hand> hands_;
  std::vector<std::size_t> feet_, chain_links_, chain_;
  std::vector<std::string> driven_;
};

}  // namespace walkman
