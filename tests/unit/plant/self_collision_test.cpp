// Which bodies of the robot can collide, and that they do.

#include <random>
#include <set>

#include "emulator/plant/contact/contact_dispatcher.h"
#include "tests/unit/plant/whole_plant.h"

namespace walkman::plant {
namespace {

using Pair = std::pair<std::string, std::string>;

class SelfCollisionOfTheRobot : public WholePlant {
 protected:
  SelfCollisionOfTheRobot() { stand_alone(BaseKind::kFixed, 0.5); }

  /// Pushes one joint with `torque` for `seconds` and returns its final position and what is in contact at
  /// the end.
  struct Outcome {
    double position = 0;
    std::set<Pair> met;
  };
  [[nodiscard]] Outcome drive_joint(const std::string& name, double torque, double seconds) const {
    const auto plant = build();
    run(*plant, static_cast<int>(seconds / Plant::kStep), drive(name), torque);
    Outcome outcome{plant->joint_position(robot_.joint_index(name)), {}};
    for (const Contact& contact : plant->contacts())
      outcome.met.insert(std::minmax(std::string(contact.body_a), std::string(contact.body_b)));
    return outcome;
  }
  /// The same without any obstruction.
  [[nodiscard]] double unhindered(const std::string& name, double torque, double seconds) const {
    RobotModel bare = robot_;
    for (Link& link : bare.links) link.collisions.clear();
    const Plant plant(bare, scene_, devices_, actuators_);
    auto& moving = const_cast<Plant&>(plant);
    run(moving, static_cast<int>(seconds / Plant::kStep), drive(name), torque);
    return plant.joint_position(robot_.joint_index(name));
  }
};

/// Smallest distance of the corners, edges and faces of two boxes' surfaces, by sampling: an upper bound.
double sampled_distance(const btTransform& A, const btVector3& a, const btTransform& B, const btVector3& b) {
  double nearest = 1e9;
  constexpr int kSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      for (int k = 0; k <= kSteps; ++k) {
        const btVector3 unit(2.0 * i / kSteps - 1, 2.0 * j / kSteps - 1, 2.0 * k / kSteps - 1);
        const btVector3 in_b = B.inverse() * (A * (unit * a));
        btVector3 beyond(0, 0, 0);
        for (int x = 0; x < 3; ++x) beyond[x] = std::max(0.0, std::abs(in_b[x]) - b[x]);
        nearest = std::min(nearest, static_cast<double>(beyond.length()));
      }
    }
  }
  return nearest;
}

TEST(BoxSeparation, IsNoMoreThanTheDistanceOfSampledBoxes) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> draw(-1, 1);
  int apart = 0, together = 0;
  for (int n = 0; n < 400; ++n) {
    const auto pose = [&](double spread) {
      btQuaternion q(draw(random), draw(random), draw(random), draw(random));
      return btTransform(q.normalized(), btVector3(draw(random), draw(random), draw(random)) * spread);
    };
    const btTransform A = pose(0.1), B = pose(0.35);
    const btVector3 a(0.05 + 0.05 * std::abs(draw(random)), 0.1, 0.15), b(0.12, 0.06, 0.1);
    const double distance = sampled_distance(A, a, B, b);
    if (const double separation = box_separation(A, a, B, b); separation > 0) {
      EXPECT_LE(separation, distance) << n;  // never apart if a point of one is in the other
      ++apart;
    } else {
      EXPECT_LT(distance, 0.04) << n;  // the sampling step
      ++together;
    }
  }
  EXPECT_GT(apart, 50);
  EXPECT_GT(together, 50);
}

TEST_F(SelfCollisionOfTheRobot, ExcusesNeighboursAndOverlapsOnly) {
  const auto plant = build();
  std::map<Pair, std::string> excused;
  for (const AllowedOverlap& pair : plant->allowed_overlaps())
    excused[std::minmax(pair.link_a, pair.link_b)] = pair.reason;
  EXPECT_EQ(excused[std::minmax<std::string>("RElb", "RForearm")], "adjacent");
  EXPECT_EQ(excused[std::minmax<std::string>("RWrMot2", "r_arm_ft")], "compound joint");
  EXPECT_EQ(excused[std::minmax<std::string>("RFinger1Distal", "RThumbDistal")], "same hand");
  for (const auto& [a, b] :
       {Pair{"RForearm", "DWYTorso"}, Pair{"RShy", "DWYTorso"}, Pair{"RForearm", "LForearm"},
        Pair{"r_arm_ft", "l_arm_ft"}, Pair{"RLowLeg", "LLowLeg"}, Pair{"RFoot", "LFoot"},
        Pair{"RThumbDistal", "LThumbDistal"}, Pair{"r_arm_ft", "RThighUpLeg"}}) {
    EXPECT_FALSE(excused.contains(std::minmax(a, b))) << a << " " << b;
  }
  // In the home posture, no part of the robot may press against another.
  auto still = build();
  run(*still, 200);
  EXPECT_TRUE(still->contacts().empty());
}

// Pairs that motions do not monitor must be pairs that cannot collide here: anything else is a blind spot.
TEST_F(SelfCollisionOfTheRobot, TheSrdfExcusesNothingThatCollides) {
  const auto plant = build();
  std::set<Pair> excused;
  for (const AllowedOverlap& pair : plant->allowed_overlaps())
    excused.insert(std::minmax(pair.link_a, pair.link_b));
  const auto carrier = [&](const std::string& link) {
    int at = robot_.link_index(link);
    while (robot_.links[static_cast<std::size_t>(at)].parent_joint >= 0) {
      const Joint& joint =
          robot_.joints[static_cast<std::size_t>(robot_.links[static_cast<std::size_t>(at)].parent_joint)];
      if (joint.type != JointType::kFixed) break;
      at = joint.parent_link;
    }
    return robot_.links[static_cast<std::size_t>(at)].name;
  };
  for (const auto& [a, b] : load_disabled_collisions(WALKMAN_URDF_DIR "/walkman.srdf", robot_))
    EXPECT_TRUE(excused.contains(std::minmax(carrier(a), carrier(b)))) << a << " " << b;
}

TEST_F(SelfCollisionOfTheRobot, TheUpperArmStopsAtTheTorso) {
  const Outcome stopped = drive_joint("RShSag", 40, 2.5);
  EXPECT_TRUE(stopped.met.contains(std::minmax<std::string>("DWYTorso", "RShy")));
  EXPECT_GT(unhindered("RShSag", 40, 2.5), stopped.position + 0.3);
  // Twice the torque only bends the springs further.
  EXPECT_NEAR(drive_joint("RShSag", 80, 2.5).position, stopped.position, 0.05);
}

TEST_F(SelfCollisionOfTheRobot, LegsStopAtEachOther) {
  const Outcome stopped = drive_joint("RHipLat", 40, 2.5);
  EXPECT_TRUE(stopped.met.contains(std::minmax<std::string>("RLowLeg", "LLowLeg")));
  EXPECT_GT(unhindered("RHipLat", 40, 2.5), stopped.position + 0.1);
}

TEST_F(SelfCollisionOfTheRobot, ArmsStopAtEachOther) {
  const auto plant = build();
  // Both shoulders turn the forearms inwards in front of the chest.
  std::set<Pair> met;
  for (int i = 0; i < 2500; ++i)
    step(*plant,
         {{drive("RShYaw"), 25}, {drive("LShYaw"), -25}, {drive("RShSag"), -15}, {drive("LShSag"), -15}});
  for (const Contact& contact : plant->contacts()) {
    met.insert(std::minmax(std::string(contact.body_a), std::string(contact.body_b)));
  }

  const bool arms = std::any_of(met.begin(), met.end(), [](const Pair& pair) {
    return (pair.first[0] == 'L' || pair.first[0] == 'l') && (pair.second[0] == 'R' || pair.second[0] == 'r');
  });
  EXPECT_TRUE(arms);
}

}  // namespace
}  // namespace walkman::plant
