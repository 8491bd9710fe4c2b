#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/camera/multisense/camera.h"
#include "emulator/camera/multisense.h"
#include "emulator/plant/plant.h"
#include "urdf/reader/device_table.h"

namespace walkman {

using namespace std::chrono_literals;

/// The scene of Experiment 1, seen by a small camera that exposes every 100 ms.
struct CameraRig {
  explicit CameraRig(int width = 64, int height = 48)
      : tree(WALKMAN_SOURCE_TREE),
        scene(load_scene(tree / "urdf/scenes/experiment_1.yaml")),
        robot(load_robot_model(scene.robot.urdf)),
        devices(load_device_table(scene.robot.device_table, robot)),
        plant(robot, scene, devices, plant::load_actuators(tree / "emulator/plant/actuators")),
        eye(robot, scene, robot.link_index("multisense/left_camera_optical_frame"), parameters(width, height),
            1) {
    // A loopback address for each process: tests run side by side.
    const int id = getpid();
    address = "127." + std::to_string(1 + id / 62500 % 250) + "." + std::to_string(1 + id / 250 % 250) + "." +
              std::to_string(1 + id % 250);
  }
  static CameraParameters parameters(int width, int height) {
    CameraParameters out;
    out.rate_hz = 10;
    sensors::StereoOptions& options = out.stereo;
    options.width = width;
    options.height = height;
    options.focal_px = 40.0 * width / 64;
    options.cx = (width - 1) / 2.0;
    options.cy = (height - 1) / 2.0;
    return out;
  }
  void advance(Time now) { eye.advance(now, plant); }

  /// What the matcher itself found, by the camera's geometry.
  [[nodiscard]] std::vector<Eigen::Vector3d> truth() {
    MultiSense::Frame frame;
    eye.render(eye.exposure(), false, frame);
    const multisense::Disparity& image = frame.disparity;
    const sensors::StereoOptions& o = eye.optics();
    std::vector<Eigen::Vector3d> points;
    for (int v = 0; v < o.height; ++v) {
      for (int u = 0; u < o.width; ++u) {
        const double d = image.pixels[points.size()] / 16.0;
        const double z = d > 0 ? o.focal_px * o.baseline / d : std::nan("");
        points.emplace_back((u - o.cx) * z / o.focal_px, (v - o.cy) * z / o.focal_px, z);
      }
    }
    return points;
  }
  void expect_truth(const camera::OrganizedCloud& cloud) {
    const std::vector<Eigen::Vector3d> expected = truth();
    ASSERT_EQ(cloud.points.size(), expected.size());
    int valid = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(cloud.points[i].allFinite(), expected[i].allFinite()) << i;
      if (!expected[i].allFinite()) continue;
      ASSERT_LT((cloud.points[i].cast<double>() - expected[i]).norm(), 1e-5 * expected[i].norm()) << i;
      ++valid;
    }
    EXPECT_GT(valid, cloud.width * cloud.height / 6);
  }

  std::filesystem::path tree;
  Scene scene;
  RobotModel robot;
  DeviceTable devices;
  plant::Plant plant;
  MultiSense eye;
  std::string address;
  Time own{};  // the client's clock
  std::function<Time()> clock = [this] { return own; };
};

/// Lets through what it is told to.
class FilteredPort final : public multisense::DatagramPort {
 public:
  explicit FilteredPort(multisense::DatagramPort& inner) : inner_(inner) {}
  void send(std::span<const std::uint8_t> datagram) override { inner_.send(datagram); }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    while (inner_.receive(datagram))
      if (passes(datagram)) return true;
    return false;
  }
  [[nodiscard]] bool wait(Time limit) override { return inner_.wait(limit); }

  std::function<bool(const std::vector<std::uint8_t>&)> passes = [](const auto&) { return true; };

 private:
  multisense::DatagramPort& inner_;
};

}  // namespace walkman
