// An SRDF: postures and pairs of links that need not be kept apart, for a known robot.

#include <cmath>

#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"
#include "urdf/reader/robot_model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static const RobotModel robot = load_robot_model(WALKMAN_SOURCE_TREE "/tests/data/mesh_robot/small.urdf",
                                                   {WALKMAN_SOURCE_TREE "/tests/data/mesh_robot/packages"});
  static fuzz::InputFile file("robot.srdf");
  file.write({data, size});
  file.read_or_refuse([] {
    for (const auto& [joint, value] : load_posture(file.path(), "rest", robot))
      fuzz::require(robot.find_joint(joint).has_value() && std::isfinite(value),
                    "a posture is of the robot's joints");
  });
  file.read_or_refuse([] {
    for (const auto& [one, other] : load_disabled_collisions(file.path(), robot))
      fuzz::require(robot.find_link(one).has_value() && robot.find_link(other).has_value(),
                    "a pair is of the robot's links");
  });
  return 0;
}
