#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "adaptation/perception/stage_one.h"
#include "urdf/reader/robot_model.h"

namespace walkman::apps {

/// A centimetre of a tube's axis.
struct Piece {
  Eigen::Vector3d p_C, axis_C;
  double radius;
  bool holds;         // fits the hand, and no other part of the object is where the fingers go round it
  bool takes_a_hand;  // the same over the width of a palm
  bool seen;          // its top is in the image
};

struct Scored {
  int graspable = 0, found = 0;
  int wrong = 0;  // handle places that no finger can go round
  double worst_axis = 0, worst_radius = 0;
};

/// Returns all pieces of an object at `X_CO`: its tubes, centimetre by centimetre, from its geometry.
[[nodiscard]] std::vector<Piece> pieces_of(const RobotModel& object, const Eigen::Isometry3d& X_CO,
                                           const StageOneParameters& parameters);

/// Scores the handles found against the pieces that exist.
[[nodiscard]] Scored scored(const std::vector<Piece>& pieces, const std::vector<perception::Handle>& handles);

}  // namespace walkman::apps
