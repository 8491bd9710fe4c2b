#include "apps/shared/scene_reach.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace walkman::apps {
namespace {

TEST(SceneReach, TableAloneOutOfReachIsRefused) {
  Scene scene = load_scene(std::string(WALKMAN_URDF_DIR) + "/scenes/experiment_1.yaml");
  const RobotModel robot = load_robot_model(scene.robot.urdf);
  scene.fixed[1].X_WF.translation().x() += 2;
  try {
    require_reach(scene, robot);
    FAIL() << "a table 2.5 m away was accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(),
                ::testing::ContainsRegex("robot_at_table.yaml:[0-9]+: fixed body 'table' is out of reach"));
  }
}

TEST(SceneReach, ShippedSceneIsWithinReachAndAFarObjectIsRefusedWithItsLine) {
  Scene scene = load_scene(std::string(WALKMAN_URDF_DIR) + "/scenes/experiment_1.yaml");
  const RobotModel robot = load_robot_model(scene.robot.urdf);
  EXPECT_NO_THROW(require_reach(scene, robot));
  scene.objects[0].X_WO.translation().x() += 0.8;
  try {
    require_reach(scene, robot);
    FAIL() << "an object 1.5 m away was accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), ::testing::ContainsRegex("experiment_1.yaml:[0-9]+: object 'bar' is out of reach"));
  }
}

}  // namespace
}  // namespace walkman::apps
