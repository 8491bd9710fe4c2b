// Positions of the phalanges around a cylinder, by plane geometry: rods around a circle.

#include "adaptation/motion/grip.h"

#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

struct Rod {
  double length, radius;  // m, from the URDF's capsules
};

Rod rod_of(const std::string& link) {
  return {link.find("Proximal") != std::string::npos ? 0.055 : 0.045,
          link.find("Thumb") != std::string::npos ? 0.010 : 0.008};
}

/// Distance from the handle's axis to a phalanx's, in the plane across the handle.
double to_axis(const Grip::Phalanx& phalanx, double length, double handle_radius) {
  const Eigen::Vector3d from = phalanx.X_HL.translation();
  const Eigen::Vector3d to = phalanx.X_HL * Eigen::Vector3d(0, 0, -length);
  const Eigen::Vector2d a(from.y(), from.z()), b(to.y(), to.z()), axis(Grip::kDepth - handle_radius, 0);
  const double along = std::clamp((axis - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + along * (b - a) - axis).norm();
}

TEST(Grip, EveryPhalanxLiesOnTheHandle) {
  const RobotModel& model = reference_robot().model;
  for (const char side : {'r', 'l'}) {
    const Grip grip(model, std::string(1, side) + "_hand_grasp", std::string(1, side) + "_handj_synergy");
    for (const double radius : {0.025, 0.03, 0.035, 0.04, 0.045}) {
      const auto phalanges = grip.around(radius);
      ASSERT_EQ(phalanges.size(), 10U);
      int lying = 0;
      for (const Grip::Phalanx& phalanx : phalanges) {
        const std::string& name = model.links[static_cast<std::size_t>(phalanx.link)].name;
        const Rod rod = rod_of(name);
        const double gap = to_axis(phalanx, rod.length, radius) - radius - rod.radius;
        EXPECT_GT(gap, -4e-4) << name << " " << radius;
        if (gap < 1e-3) ++lying;
      }
      EXPECT_EQ(lying, 10) << radius;
    }
  }
}

TEST(Grip, RefusesNamesThatAreNotThere) {
  const RobotModel& model = reference_robot().model;
  EXPECT_THROW(Grip(model, "r_hand_grsap", "r_handj_synergy"), std::out_of_range);
  EXPECT_THROW(Grip(model, "r_hand_grasp", "r_handj_sinergy"), std::out_of_range);
}

}  // namespace
}  // namespace walkman::motion
