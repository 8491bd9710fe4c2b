#pragma once

#include <string>
#include <vector>

#include "emulator/scene/true_robot.h"

namespace walkman {

/// Summary of all draws of one kind. The size of a draw with axes is its norm.
struct ErrorSummary {
  ErrorKind kind = ErrorKind::kLinkMass;
  int count = 0;
  double rms = 0;      ///< of the sizes, in the kind's unit
  double largest = 0;  ///< with its sign if the draw has one
  std::string of;      ///< part with the largest; empty: the robot
};

/// One summary for each kind that was drawn, in the order of the kinds.
[[nodiscard]] std::vector<ErrorSummary> summaries(const std::vector<ErrorDraw>& draws);

/// The true robot as a YAML file: the chosen model error, the seed, every draw, and the resulting masses.
[[nodiscard]] std::string to_yaml(const TrueRobot& truth, const ModelErrorChoice& choice, std::uint64_t seed);

}  // namespace walkman
