#pragma once

#include <cstdint>

#include "tests/unit/plant/contact_world.h"

namespace walkman::plant {

/// SimBenchmark's rolling test (Kang, D., Hwangbo, J., leggedrobotics/SimBenchmark, `rolling`): a box on a
/// floor, 5 × 5 balls on it, and a force on the box along the horizontal diagonal.
struct RollingBalls {
  static constexpr int kPerSide = 5;
  static constexpr int kBalls = kPerSide * kPerSide;
  static constexpr double kBoxMass = 10, kBallMass = 1;       // kg
  static constexpr double kBallRadius = 0.5, kBoxHeight = 1;  // m
  static constexpr double kBoxSide = 20, kSpacing = 2;        // m
  static constexpr double kFloorFriction = 0.4;               // box on floor
  static constexpr double kBallFriction = 0.8;                // ball on box
  static constexpr double kFirstPenetration = 5e-6;           // m

  /// Time without the force at the start, until all contacts are at rest as the closed form assumes, s.
  static constexpr double kSettling = 0.2;

  double force = 150;  ///< N

  /// Accelerations along the force by Coulomb's and Newton's laws, m/s².
  ///
  /// The box slides against μ₁ (M + n m) g, or stays if that exceeds the force. A rolling ball receives f = m
  /// a_ball from the box, which turns it by 5/2 f / (m r), so that its lowest point keeps up with the box at
  /// a_box = 7/2 a_ball, and M a_box = F − μ₁ (M + n m) g − n f. That requires f ≤ μ₂ m g; beyond it the ball
  /// slides: f = μ₂ m g.
  struct Accelerations {
    double box = 0, ball = 0;
  };
  [[nodiscard]] Accelerations accelerations() const;

  /// Initial centre of ball `index`; W's origin is on the floor below the centre of the box.
  [[nodiscard]] static Eigen::Vector3d p_WBall(int index);

  /// Builds the test; the box is body 0.
  void build(ContactWorld& world) const;
  /// Force on the box, N.
  [[nodiscard]] Eigen::Vector3d force_W() const;
};

/// SimBenchmark's test of hard contacts (`666`): 6 × 6 × 6 frictionless balls, slightly off the grid, are
/// dropped on a floor and topple over each other.
struct BallCube {
  static constexpr int kPerSide = 6;
  static constexpr int kBalls = kPerSide * kPerSide * kPerSide;
  static constexpr double kRadius = 0.1, kMass = 10;                            // m, kg
  static constexpr double kGap = 0.21, kPerturbation = 0.001, kHeight = 0.101;  // m

  /// Initial centres, m.
  [[nodiscard]] static std::vector<Eigen::Vector3d> centres(std::uint64_t seed);
  static void build(ContactWorld& world, const std::vector<Eigen::Vector3d>& centres);

  struct Penetration {
    double squares = 0;  ///< sum over all pairs and the floor, m²: SimBenchmark's error
    double deepest = 0;  ///< m
  };
  [[nodiscard]] static Penetration penetration(const std::vector<Eigen::Vector3d>& centres);
};

}  // namespace walkman::plant
