#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "tests/unit/plant/hand_world.h"

namespace walkman::tests {
namespace {

TEST(Probe, Strength) {
  for (const double torque : {0.5, 1.0, 2.5, 5.0}) {
    Grasp grasp;
    grasp.diameter = 0.045;
    grasp.length = 0.12;
    HandWorld world(grasp);
    world.run(3, torque);
    double squeeze = 0;
    for (int i = 0; i < 200; ++i) {
      world.step(torque);
      squeeze += world.squeeze() / 200;
    }
    std::printf("torque %.1f: tendon %.1f N, squeeze %.1f N, grip %.1f N\n", torque, world.tension(), squeeze, world.grip());
  }
  for (const double torque : {1.0, 2.5, 5.0}) {
    Grasp grasp;
    grasp.length = 1.05;
    grasp.mass = 1.2;
    HandWorld world(grasp);
    world.run(3, torque);
    const Eigen::Isometry3d X0 = world.X_PO();
    const auto settle = [&](const Eigen::Vector3d& f, const Eigen::Vector3d& t) {
      for (int i = 0; i < 1500; ++i) world.step(torque, f, t);
      const Eigen::Isometry3d X = X0.inverse() * world.X_PO();
      return X;
    };
    const double f = 5, t = 0.3;
    const double x = settle({f, 0, 0}, {0, 0, 0}).translation().norm();
    settle({0, 0, 0}, {0, 0, 0});
    const double z = settle({0, 0, -f}, {0, 0, 0}).translation().norm();
    settle({0, 0, 0}, {0, 0, 0});
    const double y = settle({0, f, 0}, {0, 0, 0}).translation().norm();
    settle({0, 0, 0}, {0, 0, 0});
    const double ry = Eigen::AngleAxisd(settle({0, 0, 0}, {0, t, 0}).linear()).angle();
    settle({0, 0, 0}, {0, 0, 0});
    const double rz = Eigen::AngleAxisd(settle({0, 0, 0}, {0, 0, t}).linear()).angle();
    settle({0, 0, 0}, {0, 0, 0});
    const double ry17 = Eigen::AngleAxisd(settle({0, 0, 0}, {0, 1.7, 0}).linear()).angle();
    std::printf("torque %.1f: along %.1f, out %.1f, across %.1f N/mm; tilt %.1f, yaw %.1f Nm/rad; 1.7 Nm: %.3f rad\n", torque,
                f / std::abs(x) / 1e3, f / z / 1e3, f / y / 1e3, t / ry, t / rz, ry17);
  }
}
}  // namespace
}  // namespace walkman::tests
