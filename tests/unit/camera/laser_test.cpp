// The laser on its spindle in the plant, read through the camera's protocol.

#include "emulator/camera/laser.h"

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/multisense/camera.h"
#include "drivers/camera/multisense/sweep.h"
#include "emulator/camera/multisense_port.h"
#include "emulator/plant/actuators/spindle.h"
#include "emulator/plant/plant.h"
#include "urdf/reader/device_table.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;

/// The robot in the room of Experiment 1, held by its base and its brakes.
struct LaserRig {
  LaserRig()
      : tree(WALKMAN_SOURCE_TREE),
        scene(with_laser(load_scene(tree / "urdf/scenes/experiment_1.yaml"))),
        robot(load_robot_model(scene.robot.urdf)),
        devices(load_device_table(scene.robot.device_table, robot)),
        plant(robot, scene, devices, plant::load_actuators(tree / "emulator/plant/actuators")),
        camera_link(robot.link_index("multisense/left_camera_optical_frame")),
        eye(robot, scene, camera_link, {}, 1),
        port(eye),
        client(port, "the camera", [this] { return now; }) {}
  static Scene with_laser(Scene scene) {
    scene.base = BaseKind::kFixed;
    scene.robot.laser = LaserParts{"multisense/head_hokuyo_frame", "hokuyo_joint"};
    return scene;
  }
  void advance(Time by) {
    for (const Time end = now + by; now < end; now += 1ms) {
      for (int drive = 0; drive < plant.drive_count(); ++drive)
        for (int i = 0; i < plant::Plant::kSubSteps; ++i) plant.advance_drive(drive, 0, true);
      plant.turn_spindle(eye.spindle_rate());
      plant.step();
      eye.advance(now + 1ms, plant);
    }
  }
  [[nodiscard]] double angle() const { return plant.joint_position(robot.joint_index("hokuyo_joint")); }

  std::filesystem::path tree;
  Scene scene;
  RobotModel robot;
  DeviceTable devices;
  plant::Plant plant;
  int camera_link;
  MultiSense eye;
  MultiSensePort port;
  Time now{};
  multisense::Camera client;
};

TEST(Spindle, TurnsAtTheRateThatItIsToldAndStaysWhereItStops) {
  LaserRig rig;
  rig.advance(200ms);
  const double at_rest = rig.angle();
  EXPECT_NEAR(at_rest, 0, 1e-3);
  for (const double rate : {0.5, 5.2, -2.0}) {
    rig.client.spin(rate);
    rig.advance(200ms);
    const double before = rig.angle();
    rig.advance(1s);
    EXPECT_NEAR(rig.angle() - before, rate, 0.01 * std::abs(rate));
  }
  rig.client.spin(0);
  rig.advance(200ms);
  const double before = rig.angle();
  rig.advance(1s);
  EXPECT_NEAR(rig.angle(), before, 1e-4);
}

TEST(Spindle, RefusesMoreThanItCan) {
  LaserRig rig;
  EXPECT_THROW(rig.client.spin(5.3), camera::Lost);
  EXPECT_EQ(rig.eye.spindle_rate(), 0);
  rig.eye.turn_spindle(100);
  rig.advance(300ms);
  const double before = rig.angle();
  rig.advance(100ms);
  EXPECT_NEAR(rig.angle() - before, 0.1 * plant::Spindle::kMostRate, 0.01);
}

TEST(Laser, SendsFortyScansASecondWithTheirSpindle) {
  LaserRig rig;
  rig.client.spin(3);
  rig.advance(300ms);
  static_cast<void>(rig.client.take_scans());
  rig.advance(1s);
  const std::vector<multisense::LidarData> scans = rig.client.take_scans();
  ASSERT_EQ(scans.size(), 40U);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const multisense::LidarData& scan = scans[i];
    EXPECT_EQ(scan.ranges_mm.size(), 1081U);
    EXPECT_EQ(scan.number, scans[0].number + i);
    EXPECT_EQ(
        1000000 * (scan.last.seconds - scan.first.seconds) + scan.last.microseconds - scan.first.microseconds,
        18750U);
    const double turn = 1e-6 * (scan.last_microradians - scan.first_microradians);
    EXPECT_NEAR(std::remainder(turn, 2 * std::numbers::pi), 3 * 0.01875, 1e-3);
  }
}

// In W the walls and the floor are where the room's URDF puts them: the poses of the laser and the camera on
// the head come from the device's own calibration, the pose of the head from the plant.
TEST(Laser, ASweepShowsTheRoomWhereItIs) {
  LaserRig rig;
  rig.client.spin(2);
  multisense::Sweep sweep(rig.client.laser_calibration());
  while (sweep.turned() < std::numbers::pi) {
    ASSERT_LT(rig.now, 5s);
    rig.advance(25ms);
    for (const multisense::LidarData& scan : rig.client.take_scans())
      sweep.add(scan, [&](Time) { return rig.plant.X_WL(rig.camera_link); });
  }
  EXPECT_GT(sweep.points().size(), 50'000U);
  double floor = 0, wall = 0;
  int on_floor = 0, on_wall = 0;
  for (const auto& point : sweep.points()) {
    const Eigen::Vector3d p = point.p_F.cast<double>();
    EXPECT_GT(p.z(), -0.1);
    EXPECT_LT(std::max(std::abs(p.x()), std::abs(p.y())), 3.1);
    if (p.x() > 1.6 && p.x() < 2.8 && std::abs(p.y()) < 2.8 && p.z() < 0.2) {
      floor += std::pow(p.z(), 2);
      ++on_floor;
    }
    if (p.x() > 2.8 && std::abs(p.y()) < 2.8 && p.z() > 0.2 && p.z() < 2.8) {
      wall += std::pow(p.x() - 3, 2);
      ++on_wall;
    }
  }
  ASSERT_GT(on_floor, 1000);
  ASSERT_GT(on_wall, 5000);
  // The device's offset (6 mm) and its noise (7 to 10 mm), along the beam.
  EXPECT_LT(std::sqrt(floor / on_floor), 0.02);
  EXPECT_LT(std::sqrt(wall / on_wall), 0.02);
}

// A client that polls every quarter of a second finds ten scans at a time, and still gets its cloud and every
// scan.
TEST(Laser, ScansAndCloudsDoNotCostEachOther) {
  LaserRig rig;
  rig.client.spin(1);
  std::vector<multisense::LidarData> scans;
  camera::OrganizedCloud cloud;
  int clouds = 0;
  for (int i = 0; i < 8; ++i) {
    const Time wanted = rig.now;
    static_cast<void>(rig.client.latest(wanted, cloud));
    rig.advance(250ms);
    clouds += rig.client.latest(wanted, cloud) ? 1 : 0;
    for (auto& scan : rig.client.take_scans()) scans.push_back(std::move(scan));
  }
  EXPECT_EQ(clouds, 8);
  ASSERT_GT(scans.size(), 75U);
  for (std::size_t i = 1; i < scans.size(); ++i) EXPECT_EQ(scans[i].number, scans[i - 1].number + 1);
}

TEST(Laser, ACameraWithoutOneSaysSo) {
  LaserRig rig;
  Scene scene = rig.scene;
  scene.robot.laser.reset();
  MultiSense eye(rig.robot, scene, rig.camera_link, {}, 1);
  MultiSensePort port(eye);
  multisense::Camera client(port, "the camera", [] { return Time{}; });
  EXPECT_EQ(client.device().laser_type, 0U);
  EXPECT_THROW(client.spin(1), camera::Lost);
  EXPECT_THROW(static_cast<void>(client.laser_calibration()), camera::Lost);
}

TEST(Sweep, RefusesACalibrationThatIsNone) {
  EXPECT_THROW(multisense::Sweep(multisense::LidarCalibration{}), std::runtime_error);
}

}  // namespace
}  // namespace walkman
