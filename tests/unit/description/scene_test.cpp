#include "emulator/scene/scene.h"

#include <cmath>

#include <gmock/gmock.h>

#include "robots.h"
#include "urdf/reader/extent.h"

namespace walkman::testing {
namespace {

const Scene& experiment_1() {
  static const Scene scene = load_scene(kUrdf / "scenes/experiment_1.yaml");
  return scene;
}

TEST(Experiment1, ObjectIsThePapers) {
  ASSERT_EQ(experiment_1().objects.size(), 1U);
  const SceneObject& bar = experiment_1().objects.front();
  EXPECT_NEAR(bar.length, 1.05, 1e-9);
  EXPECT_NEAR(bar.mass(), 1.2, 1e-9);
  const Eigen::Vector3d com = bar.p_OOcm();
  EXPECT_NEAR(com.x() + bar.length / 2, 0.520, 1e-3);
  EXPECT_NEAR(com.tail<2>().norm(), 0, 1e-12);
}

TEST(Experiment1, ItsRobotIsACalibratedOne) {
  EXPECT_EQ(experiment_1().model_error.level, "calibrated");
  EXPECT_TRUE(experiment_1().model_error.changed.empty());
  EXPECT_FALSE(experiment_1().model_error.weighed_parts);
}

TEST(Experiment1, MovingTheLeftWeightGivesThePapersOtherCentresOfMass) {
  // d_r of experiments 1 to 4 in the paper's table.
  const double paper[] = {0.520, 0.565, 0.600, 0.645};
  SceneObject bar = experiment_1().objects.front();
  for (int i = 0; i < 4; ++i) {
    bar.weights.front().X_LA = bar.X_OX(0.10 * (i + 1));
    EXPECT_NEAR(bar.p_OOcm().x() + bar.length / 2, paper[i], 0.0035) << i;
  }
}

TEST(Experiment1, BarLiesAcrossTheTableOnItsWeights) {
  const SceneObject& bar = experiment_1().objects.front();
  const Eigen::Vector3d left_end = bar.X_WO * Eigen::Vector3d(-bar.length / 2, 0, 0);
  const Eigen::Vector3d right_end = bar.X_WO * Eigen::Vector3d(bar.length / 2, 0, 0);
  EXPECT_NEAR(left_end.y() - right_end.y(), 1.05, 1e-6);  // the robot's left is +y
  const auto& clamp = std::get<BoxShape>(bar.weights.front().model.links.front().collisions.front().shape);
  EXPECT_NEAR(bar.X_WO.translation().z() - clamp.size.z() / 2, 0.90, 1e-12);

  ASSERT_EQ(experiment_1().fixed.size(), 2U);
  const FixedBody& table = experiment_1().fixed.back();
  EXPECT_EQ(table.name, "table");
  const LinkGeometry& top = table.model.links.front().collisions.front();
  const Eigen::Vector3d size = std::get<BoxShape>(top.shape).size;
  const Eigen::Vector3d centre = table.X_WF * top.X_LG.translation();
  EXPECT_NEAR(centre.z() + size.z() / 2, 0.90, 1e-12);
  EXPECT_NEAR(centre.x() - size.x() / 2, 0.50, 1e-12);
  const PoseJitter& jitter = experiment_1().jitter;
  for (const AttachedWeight& weight : bar.weights) {
    const double arm = bar.X_OA(weight).translation().x();
    const Eigen::Vector3d p_W = bar.X_WO * Eigen::Vector3d(arm, 0, 0);
    const double reach = jitter.yaw * std::abs(arm) + clamp.size.y() / 2;
    EXPECT_GT(p_W.x() - jitter.x - reach, centre.x() - size.x() / 2) << weight.name;
    EXPECT_LT(p_W.x() + jitter.x + reach, centre.x() + size.x() / 2) << weight.name;
    EXPECT_LT(std::abs(p_W.y() - centre.y()) + jitter.y + clamp.size.x(), size.y() / 2) << weight.name;
  }
}

TEST(Experiment1, RobotStandsOnTheFloor) {
  const Scene& scene = experiment_1();
  EXPECT_EQ(scene.base, BaseKind::kFloating);
  const RobotModel robot = load_robot_model(scene.robot.urdf);
  const Posed pose(robot, load_posture(scene.robot.srdf, scene.posture, robot));
  EXPECT_NEAR((scene.X_WB * pose("r_sole")).translation().z(), 0, 1e-4);
  EXPECT_NEAR((scene.X_WB * pose("l_sole")).translation().z(), 0, 1e-4);
}

TEST(Experiment1, WeightIsASteelClamp) {
  // Box minus cylinder, from the drawing: 90 x 90 x 15 mm with a 70 mm hole.
  const RobotModel weight = load_robot_model(kUrdf / "objects/weight_500g.urdf");
  const double a = 0.09;
  const double t = 0.015;
  const double r = 0.035;
  const double density = 0.5 / (a * a * t - M_PI * r * r * t);
  EXPECT_NEAR(density, 7850, 50);
  const double box = density * a * a * t;
  const double hole = density * M_PI * r * r * t;
  const Eigen::Matrix3d& I = weight.links.front().I_LLcm_L;
  EXPECT_NEAR(I(0, 0), box * a * a / 6 - hole * r * r / 2, 1e-8);
  EXPECT_NEAR(I(1, 1), box * (a * a + t * t) / 12 - hole * (3 * r * r + t * t) / 12, 1e-8);
  EXPECT_NEAR(I(2, 2), I(1, 1), 1e-12);
}

TEST(ExtendedScene, HasWhatItSaysAndElseItsBase) {
  const Scene scene = load_scene(kData / "extended_scene.yaml");
  const Scene& base = experiment_1();
  EXPECT_EQ(scene.robot.urdf, base.robot.urdf);
  EXPECT_EQ(scene.model_error.level, "calibrated");
  EXPECT_EQ(scene.jitter.x, base.jitter.x);
  EXPECT_EQ(scene.jitter.yaw, 0);
  ASSERT_EQ(scene.fixed.size(), 3U);
  EXPECT_EQ(scene.fixed[2].name, "box");
  ASSERT_EQ(scene.objects.size(), 1U);
  const SceneObject& bar = scene.objects.front();
  EXPECT_TRUE(bar.X_WO.isApprox(base.objects.front().X_WO, 1e-15));
  ASSERT_EQ(bar.weights.size(), 3U);
  EXPECT_NEAR(bar.X_OA(bar.weights[0]).translation().x(), 0.20 - 0.525, 1e-8);
  EXPECT_NEAR(bar.X_OA(bar.weights[1]).translation().x(), 0.95 - 0.525, 1e-8);
  EXPECT_EQ(bar.weights[2].name, "third_weight");
  EXPECT_NEAR(bar.X_OA(bar.weights[2]).translation().y(), 0.05, 1e-12);
  EXPECT_NEAR(bar.X_OA(bar.weights[2]).linear()(1, 0), std::sin(1.5), 1e-12);
}

TEST(SceneEvents, ComeInOrderOfTimeWithAllTheySay) {
  const Scene scene = load_scene(kData / "scene_events.yaml");
  ASSERT_EQ(scene.events.size(), 4U);
  EXPECT_EQ(scene.events[0].at, 1.5);
  const auto& chest = std::get<PushEvent>(scene.events[0].what);
  EXPECT_EQ(chest.link, "DWYTorso");
  EXPECT_EQ(chest.force_W, Eigen::Vector3d(300, 0, 0));
  EXPECT_EQ(chest.p_LP, Eigen::Vector3d::Zero());
  EXPECT_EQ(chest.duration, 0.1);
  const auto& elbow = std::get<PushEvent>(scene.events[1].what);
  EXPECT_EQ(elbow.p_LP, Eigen::Vector3d(0, 0.1, 0));
  EXPECT_THAT(scene.events[1].where, ::testing::EndsWith("events.yaml:20"));
  EXPECT_NEAR(std::get<MoveWeightEvent>(scene.events[2].what).X_LA.translation().x(), 0.4 - 1.05 / 2, 1e-8);
  EXPECT_EQ(std::get<RemoveWeightEvent>(scene.events[3].what).weight, "left_weight");
}

TEST(HoistRope, IsReadAndHasDefaults) {
  const HoistRope rope = load_scene(kData / "scene_events.yaml").rope;
  EXPECT_EQ(rope.p_LE, Eigen::Vector3d(0, 0, 0.2));
  EXPECT_EQ(rope.p_WA.value(), Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(rope.length.value(), 1.4);
  const HoistRope none = experiment_1().rope;
  EXPECT_FALSE(none.p_WA || none.length);
}

TEST(Jitter, IsUniformWithinItsBoundsAndDeterministic) {
  double sum_x = 0;
  double sum_yaw2 = 0;
  constexpr int kDraws = 2000;
  for (int seed = 0; seed < kDraws; ++seed) {
    Scene a = experiment_1();
    Scene b = experiment_1();
    apply_jitter(a, static_cast<std::uint64_t>(seed));
    apply_jitter(b, static_cast<std::uint64_t>(seed));
    EXPECT_TRUE(a.objects[0].X_WO.matrix() == b.objects[0].X_WO.matrix());
    const Eigen::Isometry3d& before = experiment_1().objects[0].X_WO;
    const Eigen::Isometry3d& after = a.objects[0].X_WO;
    const Eigen::Vector3d shift = after.translation() - before.translation();
    EXPECT_LE(std::abs(shift.x()), 0.01);
    EXPECT_LE(std::abs(shift.y()), 0.01);
    EXPECT_EQ(shift.z(), 0);
    const Eigen::Matrix3d turn = after.linear() * before.linear().transpose();
    const double yaw = std::atan2(turn(1, 0), turn(0, 0));
    EXPECT_LE(std::abs(yaw), 0.035 + 1e-12);
    EXPECT_NEAR(turn(2, 2), 1, 1e-12);
    sum_x += shift.x();
    sum_yaw2 += yaw * yaw;
  }
  // Uniform on ±w: mean 0 with standard error w/sqrt(3 n), mean square w²/3; 5 standard errors allowed.
  EXPECT_NEAR(sum_x / kDraws, 0, 5 * 0.01 / std::sqrt(3.0 * kDraws));
  const double w2 = 0.035 * 0.035;
  EXPECT_NEAR(sum_yaw2 / kDraws, w2 / 3, 5 * w2 * std::sqrt(4.0 / 45 / kDraws));
}

void expect_rubber(const Surface& surface) {
  EXPECT_EQ(surface.rolling_friction, 0.002);
  EXPECT_EQ(surface.spinning_friction, 0.003);
  EXPECT_EQ(surface.stiffness, 30000);
  EXPECT_EQ(surface.damping, 250);
}

TEST(Contact, IsTheUrdfsLinkByLinkAndTheScenesWhereItSaysSo) {
  const Scene scene = load_scene(kData / "scene_surfaces.yaml");
  const auto& links = scene.objects[0].model.links;
  EXPECT_EQ(links[0].surface.friction, 1.1);
  EXPECT_EQ(links[0].surface.restitution, 0.4);
  expect_rubber(links[0].surface);
  EXPECT_EQ(links[1].surface.friction, 0.5);  // Bullet's default
  EXPECT_EQ(links[1].surface.restitution, 0);
  for (const Link& link : scene.objects[1].model.links) {
    EXPECT_EQ(link.surface.friction, 0.05);
    EXPECT_EQ(link.surface.restitution, 0);
  }
  expect_rubber(scene.objects[1].model.links[0].surface);
}

TEST(Extent, OfTurnedShapes) {
  EXPECT_NEAR(extent_along_x(load_robot_model(kData / "turned_shapes.urdf")).min, -0.5 - 0.1, 1e-9);
  // A box 0.2 x 0.2 x 1 turned by 45 degrees about z, centred 1 m ahead: it extends half a diagonal beyond
  // its centre.
  EXPECT_NEAR(extent_along_x(load_robot_model(kData / "turned_shapes.urdf")).max, 1 + 0.1 * std::sqrt(2.0),
              1e-9);
}

}  // namespace
}  // namespace walkman::testing
