#pragma once

#include <string>
#include <vector>

#include "emulator/scene/true_robot.h"

namespace walkman {

/// All draws of one kind in short. The size of a draw with axes is its norm.
struct ErrorSummary {
  ErrorKind kind = ErrorKind::kLinkMass;
  int count = 0;
  double rms = 0;      ///< of the sizes, in the kind's unit
  double largest = 0;  ///< with its sign where the draw has one
  std::string of;      ///< which part has the largest; empty: the robot
};

/// One for each kind that was drawn, in the kinds' order.
[[nodiscard]] std::vector<ErrorSummary> summaries(const std::vector<ErrorDraw>& draws);

/// The true robot as a YAML file: what was asked for, the seed, every draw, and the masses that came of them.
[[nodiscard]] std::string to_yaml(const TrueRobot& truth, const ModelErrorChoice& choice, std::uint64_t seed);

}  // namespace walkman
