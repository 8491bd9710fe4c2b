#include "adaptation/motion/gaze.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

class GazeTest : public testing::Test {
 protected:
  GazeTest()
      : robot(reference_robot()),
        known(load_robot_description(std::string(WALKMAN_URDF_DIR) + "/walkman.robot.yaml")),
        gaze(known, robot.joint_names),
        posed(robot.model, robot.joint_names),
        camera(robot.model.link_index(known.description.optical_frame)) {
    posed.update(robot.q_home);
  }

  /// Returns a point of the base frame as the camera sees it at home.
  [[nodiscard]] Eigen::Vector3d from_home(const Eigen::Vector3d& p_B) {
    posed.update(robot.q_home);
    return posed.X_WL(camera).inverse() * p_B;
  }

  /// Angle between the camera's axis at q and a point of the base frame, rad.
  [[nodiscard]] double beside(const Eigen::VectorXd& q, const Eigen::Vector3d& p_B) {
    posed.update(q);
    const Eigen::Vector3d p_C = posed.X_WL(camera).inverse() * p_B;
    return std::acos(p_C.normalized().z());
  }

  /// Minimum distance of points all over the undersides of the head's two boxes from the chest's capsule and
  /// the shoulders' boxes, m; dimensions from the URDF.
  [[nodiscard]] double off_the_body(const Eigen::VectorXd& q) {
    posed.update(q);
    double least = 1;
    const auto underside = [&](const char* link, const Eigen::Vector3d& middle, const Eigen::Vector3d& size) {
      const Eigen::Isometry3d X_WL = posed.X_WL(robot.model.link_index(link));
      for (int x = -20; x <= 20; ++x) {
        for (int y = -20; y <= 20; ++y) {
          const Eigen::Vector3d p_W =
              X_WL * (middle + Eigen::Vector3d(x / 40.0, y / 40.0, -0.5).cwiseProduct(size));
          least = std::min({least, off_the_chest(p_W), off_a_shoulder(p_W, "RShp", -0.0528),
                            off_a_shoulder(p_W, "LShp", 0.0528)});
        }
      }
    };
    underside("NeckPitch", {-0.0214, 0.0004, 0.038}, {0.0879, 0.1409, 0.1212});
    underside("multisense/head", {-0.0971, 0.0008, 0.0467}, {0.263, 0.1995, 0.2306});
    return least;
  }

  [[nodiscard]] double off_the_chest(const Eigen::Vector3d& p_W) const {
    Eigen::Vector3d r = posed.X_WL(robot.model.link_index("DWYTorso")).inverse() * p_W -
                        Eigen::Vector3d(-0.0011, 0.0003, -0.033);
    r.y() -= std::clamp(r.y(), -0.1803, 0.1803);
    return r.norm() - 0.1177;
  }

  [[nodiscard]] double off_a_shoulder(const Eigen::Vector3d& p_W, const char* link, double y) const {
    const Eigen::Vector3d r =
        posed.X_WL(robot.model.link_index(link)).inverse() * p_W - Eigen::Vector3d(0.0007, y, 0.012);
    return (r.cwiseAbs() - Eigen::Vector3d(0.2113, 0.2301, 0.1513) / 2).cwiseMax(0).norm();
  }

  const ReferenceRobot& robot;
  KnownRobot known;
  Gaze gaze;
  KinematicTree posed;
  int camera;
};

TEST_F(GazeTest, LooksAtWhatIsFree) {
  for (const Eigen::Vector3d& p_B :
       {Eigen::Vector3d(2, -0.45, 0.5), {2, 0.45, 0.5}, {3, 0.4, 0.8}, {2, 0, 0.2}}) {
    const Eigen::VectorXd q = gaze.towards(robot.q_home, from_home(p_B)).back();
    EXPECT_LT(beside(q, p_B), 1.5 * Gaze::kStep) << p_B.transpose();
    EXPECT_GT(beside(robot.q_home, p_B), 5 * Gaze::kStep) << p_B.transpose();
  }
}

// Points near the robot and to a side, such as on a table: to turn there, the head has to go up, and may get
// no nearer to the point by that.
TEST_F(GazeTest, KeepsTheHeadOffTheBodyAllTheWay) {
  for (const Eigen::Vector3d& p_B : {Eigen::Vector3d(0.6, -0.7, -0.15),
                                     {0.6, -0.4, -0.15},
                                     {0.6, 0.15, -0.15},
                                     {0.6, 0.7, -0.15},
                                     {0.8, -0.7, 0.1},
                                     {0.8, 0.7, 0.1},
                                     {1.0, -0.5, 0.2},
                                     {1.0, 0.3, 0.0}}) {
    Eigen::VectorXd from = robot.q_home;
    for (const Eigen::VectorXd& to : gaze.towards(robot.q_home, from_home(p_B))) {
      for (const double share : {0.25, 0.5, 0.75, 1.0}) {
        Eigen::VectorXd q = from + share * (to - from);
        for (const double pan : {-Gaze::kPanSway, Gaze::kPanSway}) {
          for (const double tilt : {-Gaze::kTiltSway, Gaze::kTiltSway}) {
            Eigen::VectorXd q_out = q;
            q_out[gaze.pan()] += pan;
            q_out[gaze.tilt()] += tilt;
            EXPECT_GT(off_the_body(q_out), 0)
                << p_B.transpose() << " pan " << q[gaze.pan()] << " tilt " << q[gaze.tilt()];
          }
        }
      }
      from = to;
    }
    EXPECT_LE(beside(from, p_B), beside(robot.q_home, p_B)) << p_B.transpose();
    if (p_B.z() > 0.05) {
      EXPECT_GT(std::abs(from[gaze.pan()]), 0.1) << p_B.transpose();
    }
  }
}

TEST_F(GazeTest, MovesNothingElseAndStaysWithinLimits) {
  const Eigen::VectorXd q = gaze.towards(robot.q_home, from_home({-1, -1, 0.5})).back();
  for (int dof = 0; dof < posed.dof(); ++dof) {
    if (dof != gaze.pan() && dof != gaze.tilt()) {
      EXPECT_EQ(q[dof], robot.q_home[dof]);
    }
    EXPECT_GE(q[dof], posed.limits(dof).lower);
    EXPECT_LE(q[dof], posed.limits(dof).upper);
  }
  EXPECT_LT(q[gaze.pan()], -0.2);
}

}  // namespace
}  // namespace walkman::motion
