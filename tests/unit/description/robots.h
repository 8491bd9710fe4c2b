#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/kinematics.h"
#include "urdf/reader/robot_model.h"

namespace walkman::testing {

inline const std::filesystem::path kUrdf = WALKMAN_URDF_DIR;
inline const std::filesystem::path kData = std::filesystem::path(WALKMAN_TEST_DATA) / "description";

inline const RobotModel& walkman_model() {
  static const RobotModel model = load_robot_model(kUrdf / "walkman.urdf");
  return model;
}

/// Poses of the links of one robot in one posture, by name.
class Posed {
 public:
  Posed(const RobotModel& model, const std::map<std::string, double>& posture)
      : model_(model), X_RL_(link_poses(model, posture)) {}

  const Eigen::Isometry3d& operator()(const std::string& link) const {
    return X_RL_[static_cast<std::size_t>(model_.link_index(link))];
  }
  const std::vector<Eigen::Isometry3d>& all() const { return X_RL_; }

 private:
  const RobotModel& model_;
  std::vector<Eigen::Isometry3d> X_RL_;
};

/// Returns the message of the exception that `f` throws; empty if it throws none.
template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace walkman::testing
