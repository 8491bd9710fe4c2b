// Effects of an injected fault where it acts: in frames, readings, springs, images and on objects; and that
// they disappear with their cause.

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/canopen/sdo_client.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "tests/rigs/breakable_robot.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using rigs::BreakableRobot;

bus::CanBus& right_arm(BreakableRobot& rig) {
  for (bus::CanBus* bus : rig.emulator->buses())
    if (bus->name() == "rarm") return *bus;
  throw std::logic_error("the robot has no bus rarm");
}

/// The drive's heartbeats have the rate of its own clock, and the proper rate again once that is correct.
TEST(InjectedClockDrift, IsInTheHeartbeatsPeriod) {
  BreakableRobot rig(false);
  std::vector<Time> beats;
  right_arm(rig).set_observer([&beats](const can::StampedFrame& f) {
    if (f.frame.id == 0x70E) beats.push_back(f.time);
  });
  const auto period = [&] {
    rig.run(500ms);  // lets the period under way end
    beats.clear();
    rig.run(3s);
    return std::chrono::duration<double>(beats.back() - beats.front()).count() /
           static_cast<double>(beats.size() - 1);
  };
  const double sound = period();
  rig.emulator->inject(faults::parse_fault({"clock-drift", "RElbj", "ppm=250000"}));
  EXPECT_NEAR(period(), sound / 1.25, 1e-3);
  faults::Injection other = faults::parse_fault({"clock-drift", "RElbj", "ppm=100000"});
  other.name = "other";
  rig.emulator->inject(other);
  EXPECT_NEAR(period(), sound / 1.25 / 1.1, 1e-3);
  rig.emulator->clear_fault("other");
  EXPECT_NEAR(period(), sound / 1.25, 1e-3);
  rig.emulator->clear_fault("RElbj-clock-drift");
  EXPECT_NEAR(period(), sound, 1e-3);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// Two flips of one bit would cancel.
TEST(InjectedBitFlip, FlipsAsManyBitsAsItSays) {
  BreakableRobot rig(false);
  bus::ComputerPort* const port = &right_arm(rig).add_port();
  // Without its master, the node is pre-operational before long, and stays so.
  rig.emulator->advance(rig.emulator->now() + 2s);
  constexpr unsigned kPreOperational = 0x7F;
  for (const int bits : {1, 2, 4, 8, 64}) {
    rig.emulator->inject(
        faults::parse_fault({"payload-bitflip", "RElbj", "share=1", fmt::format("bits={}", bits)}));
    can::StampedFrame stamped;
    while (port->receive(stamped)) {
    }
    rig.emulator->advance(rig.emulator->now() + 1s);
    int beats = 0;
    while (port->receive(stamped)) {
      if (stamped.frame.id != 0x70E) continue;
      ++beats;
      EXPECT_EQ(std::popcount(stamped.frame.data[0] ^ kPreOperational), std::min(bits, 8));
    }
    EXPECT_GE(beats, 9) << bits;
    rig.emulator->clear_fault("RElbj-payload-bitflip");
  }
}

/// Its frames do not wait in a queue that empties after its end.
TEST(InjectedFlood, EndsWhenItIsOver) {
  BreakableRobot rig(false);
  Time last{};
  std::uint64_t frames = 0;
  right_arm(rig).set_observer([&](const can::StampedFrame& f) {
    if (f.frame.id != 1 || f.frame.error) return;
    last = f.time;
    ++frames;
  });
  const Time began = rig.emulator->now();
  rig.emulator->inject(faults::parse_fault({"babbling-idiot", "rarm", "for=0.1"}));
  rig.emulator->advance(began + 500ms);
  EXPECT_GT(last, began + 98ms);
  EXPECT_LT(last, began + 103ms);
  // A frame of 8 bytes has 111 bits and up to 24 for stuffing (ISO 11898-1) at 1 Mbit/s.
  EXPECT_GT(frames, 0.099 / 135e-6);
  EXPECT_LT(frames, 0.103 / 111e-6);
}

/// A client that reads a name of more than four bytes encounters it (CiA 301, 7.2.4.3.17: 0503 0000h).
TEST(InjectedToggleError, EndsASegmentedUpload) {
  BreakableRobot rig(false);
  bus::ComputerPort* const port = &right_arm(rig).add_port();
  const auto read_name = [&] {
    canopen::SdoClient client(14, 200ms);
    client.upload({0x1008, 0}, rig.emulator->now());
    for (int i = 0; i < 200 && client.state() == canopen::SdoClient::State::kBusy; ++i) {
      if (client.pending() != nullptr) {
        EXPECT_EQ(port->send(*client.pending()), can::SendResult::kQueued);
        client.sent();
      }
      rig.run(BreakableRobot::kCycle);
      can::StampedFrame in;
      while (port->receive(in))
        if (in.frame.id == 0x58E) client.receive(in.frame, rig.emulator->now());
    }
    return client;
  };
  EXPECT_EQ(read_name().state(), canopen::SdoClient::State::kDone);
  rig.emulator->inject(faults::parse_fault({"sdo-toggle-error", "RElbj"}));
  EXPECT_EQ(read_name().abort_code(), canopen::SdoAbort::kToggle) << "0503 0000h";
}

/// A softer spring deflects by its load divided by its stiffness, with the transmission's play unchanged.
TEST(InjectedCompliance, LetsTheSpringGiveByItsLoadOverItsStiffness) {
  BreakableRobot rig(false);
  const auto names = rig.robot->joint_names();
  const auto shoulder =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "RShLat") - names.begin());
  const auto deflection_at = [&](const char* stiffness) {
    const faults::Injection softer = faults::parse_fault({"compliance-change", "RShLat", stiffness});
    rig.emulator->inject(softer);
    rig.run(3s);
    const auto& joint = rig.robot->joints()[shoulder];
    const double deflection = joint.motor_position - joint.link_position;
    EXPECT_TRUE(rig.emulator->clear_fault(softer.name));
    return deflection;
  };
  const double sound = deflection_at("stiffness=1"), half = deflection_at("stiffness=0.5"),
               quarter = deflection_at("stiffness=0.25");
  EXPECT_FALSE(rig.robot->fault());
  ASSERT_GT(std::abs(half - sound), 1e-3);
  EXPECT_NEAR((quarter - half) / (half - sound), 2, 0.1);
}

/// A loaded transmission rests at one end of its play: the link gives way by half of it.
TEST(InjectedBacklash, LetsTheLinkGiveByHalfOfThePlay) {
  BreakableRobot rig(false);
  const auto names = rig.robot->joint_names();
  const auto shoulder =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "RShLat") - names.begin());
  const int link = rig.model.joint_index("RShLat");
  const auto given = [&] {
    rig.run(3s);
    return rig.motors()[shoulder] - rig.emulator->plant().joint_position(link);
  };
  const double sound = given();
  rig.emulator->inject(faults::parse_fault({"backlash", "RShLat", "play=0.04"}));
  EXPECT_NEAR(std::abs(given() - sound), 0.02, 0.002);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
  EXPECT_TRUE(rig.emulator->clear_fault("RShLat-backlash"));
  EXPECT_NEAR(given(), sound, 1e-3);
}

TEST(InjectedTorqueDropout, ReadsZeroAndComesBack) {
  BreakableRobot rig(false);
  const auto names = rig.robot->joint_names();
  const auto shoulder =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "RShLat") - names.begin());
  ASSERT_GT(std::abs(rig.robot->joints()[shoulder].torque), 1.0);
  faults::Injection dropout = faults::parse_fault({"torque-dropout", "RShLat", "for=0.1"});
  rig.emulator->inject(dropout);
  rig.run(50ms);
  EXPECT_EQ(rig.robot->joints()[shoulder].torque, 0);
  rig.run(500ms);
  EXPECT_GT(std::abs(rig.robot->joints()[shoulder].torque), 1.0);
}

/// The object on the table is the scene's, as modified by the fault.
TEST(InjectedObjectFault, IsOfTheObjectAndGoesAway) {
  BreakableRobot rig(false);
  const auto bar = [&] { return rig.emulator->plant().object(0); };
  const SceneObject sound = bar();
  const auto with = [&](const std::vector<std::string>& words) {
    const faults::Injection injection = faults::parse_fault(words);
    rig.emulator->inject(injection);
    rig.run(100ms);
    SceneObject broken = bar();
    EXPECT_TRUE(rig.emulator->clear_fault(injection.name));
    EXPECT_NEAR(bar().mass(), sound.mass(), 1e-9);
    EXPECT_EQ(bar().model.links.front().surface.friction, sound.model.links.front().surface.friction);
    return broken;
  };
  // Weights of 0.5 kg, 10 cm from either end of a bar of 105 cm.
  const SceneObject lighter = with({"weight-removed", "left_weight"});
  EXPECT_NEAR(sound.mass() - lighter.mass(), 0.5, 1e-9);
  EXPECT_NEAR(lighter.mass() * lighter.p_OOcm().x(), sound.mass() * sound.p_OOcm().x() + 0.5 * 0.425, 1e-6);
  const SceneObject heavier = with({"payload", "bar", "mass=3"});
  EXPECT_NEAR(heavier.mass() - sound.mass(), 3, 1e-9);
  EXPECT_NEAR((heavier.p_OOcm() - sound.p_OOcm()).norm(), 0, 1e-9) << "at the centre of mass";
  const SceneObject slippery = with({"slip", "bar", "friction=0.25"});
  EXPECT_NEAR(slippery.model.links.front().surface.friction,
              0.25 * sound.model.links.front().surface.friction, 1e-12);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// A force on the hand is a force on its sensor.
TEST(InjectedPush, IsReadByTheSensorBehindIt) {
  BreakableRobot rig(false);
  rig.run(3s);
  const Eigen::Vector3d before = rig.wrist().force;
  rig.emulator->inject(faults::parse_fault({"push", "RSoftHand", "y=15", "for=1"}));
  rig.run(500ms);
  EXPECT_NEAR((rig.wrist().force - before).norm(), 15, 1.5);
  rig.run(2s);
  EXPECT_LT((rig.wrist().force - before).norm(), 1);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// The load on a wrist's sensor stays the same; its readings do not.
TEST(InjectedSensorFault, IsInTheReadingsAndGoesAway) {
  // Mean of ten samples, up to 0.2 s from now.
  const auto reading = [](BreakableRobot& rig) {
    rig.run(150ms);
    constexpr int kSamples = 10;
    Wrench mean;
    for (int i = 0; i < kSamples; ++i) {
      rig.run(BreakableRobot::kCycle);
      const Wrench sample = rig.wrist();
      mean.force += sample.force / kSamples;
      mean.torque += sample.torque / kSamples;
    }
    return mean;
  };
  constexpr double kMeanTime = 0.1775;  // s
  BreakableRobot rig(false);
  rig.run(3s);  // until the sway has decayed
  const Wrench sound = reading(rig);
  ASSERT_GT(sound.force.norm(), 3.0);
  const auto broken = [&](const std::vector<std::string>& words) {
    const faults::Injection injection = faults::parse_fault(words);
    rig.emulator->inject(injection);
    Wrench read = reading(rig);
    EXPECT_TRUE(rig.emulator->clear_fault(injection.name));
    EXPECT_LT((reading(rig).force - sound.force).norm(), 1.0) << "mended";
    return read;
  };
  EXPECT_LT((broken({"ft-gain", "r_arm_ft", "gain=1.5"}).force - 1.5 * sound.force).norm(), 1.0);
  const Wrench turned = broken({"ft-sign", "r_arm_ft", "axis=0"});
  EXPECT_NEAR(turned.force.x(), -sound.force.x(), 1.0);
  EXPECT_NEAR(turned.force.y(), sound.force.y(), 1.0);
  const Wrench drifted = broken({"ft-bias-drift", "r_arm_ft", "force=50", "torque=2"});
  EXPECT_NEAR(drifted.force.z() - sound.force.z(), 50 * kMeanTime, 1.5);
  EXPECT_NEAR(drifted.torque.z() - sound.torque.z(), 2 * kMeanTime, 0.1);
  const Wrench swapped = broken({"ft-swap", "r_arm_ft", "axis=0", "other=2"});
  EXPECT_NEAR(swapped.force.x(), sound.force.z(), 1.0);
  EXPECT_NEAR(swapped.force.z(), sound.force.x(), 1.0);
  const Wrench saturated = broken({"ft-saturation", "r_arm_ft", "force=1", "torque=0.05"});
  EXPECT_NEAR(saturated.force.cwiseAbs().maxCoeff(), 1, 0.051);  // half a resolution step on the bus
  EXPECT_LE(saturated.torque.cwiseAbs().maxCoeff(), 0.055);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// The robot of Experiment 1 on its brakes, with sensors that have no errors of their own.
struct RobotOnBrakes : rigs::HeldRobot {
  static constexpr std::uint8_t kNode = 18;  // of r_arm_ft

  explicit RobotOnBrakes(const std::vector<SceneEvent>& events = {}) {
    scene.events = events;
    options.sensor_errors = SensorErrors::kNone;
    emulator.emplace(model, devices, scene, options);
    for (const Bus& bus : devices.buses)
      for (const Device& device : bus.devices) {
        if (device.name == "r_arm_ft") return;
        sensor += device.kind == DeviceKind::kForceTorque ? 1 : 0;
      }
  }

  /// Fy that the wrist's sensor reads, N, by 7130h: in 0.1 N.
  [[nodiscard]] double reading() {
    for (bus::CanBus* bus : emulator->buses())
      for (bus::Participant* participant : bus->participants()) {
        const auto* node = dynamic_cast<const nodes::CanopenSlave*>(participant);
        if (bus->name() == "rarm" && node != nullptr && node->node_id() == kNode)
          return 0.1 * nodes::from_raw<std::int16_t>(node->dictionary().find(0x7130, 2)->raw);
      }
    return std::nan("");
  }
  /// By how much that is wrong.
  [[nodiscard]] double error() { return reading() - emulator->plant().F_So_S(sensor).force.y(); }
  void inject(const std::vector<std::string>& words) { emulator->inject(faults::parse_fault(words)); }

  int sensor = 0;  // its number in the plant
};

/// Half a step of 7130h, and the sample or two that a fault begins later.
constexpr double kReadingError = 0.05 + 2 * 0.05;  // N

TEST(InjectedSensorFaults, KeepTheirStateWhenAnotherBeginsOrEnds) {
  RobotOnBrakes robot;
  robot.inject({"ft-bias-drift", "r_arm_ft", "force=50"});
  robot.emulator->advance(1s);
  EXPECT_NEAR(robot.error(), 50, kReadingError);
  robot.inject({"ft-sign", "r_arm_ft", "axis=0"});
  robot.emulator->advance(2s);
  EXPECT_NEAR(robot.error(), 100, kReadingError);
  robot.inject({"ft-stuck", "r_arm_ft"});
  robot.emulator->advance(2050ms);
  const double frozen = robot.reading();
  robot.emulator->clear_fault("r_arm_ft-ft-sign");
  robot.emulator->advance(3s);
  EXPECT_EQ(robot.reading(), frozen);
  robot.inject({"ft-noise", "r_arm_ft", "force=5"});
  robot.emulator->advance(3050ms);
  EXPECT_EQ(robot.reading(), frozen);
  robot.emulator->clear_fault("r_arm_ft-ft-noise");
  robot.emulator->clear_fault("r_arm_ft-ft-stuck");
  robot.emulator->advance(4s);
  EXPECT_NEAR(robot.error(), 200, kReadingError);
  robot.emulator->clear_fault("r_arm_ft-ft-bias-drift");
  robot.emulator->advance(4050ms);
  EXPECT_NEAR(robot.error(), 0, kReadingError);
}

TEST(InjectedSensorFaults, LeaveTheFaultOfTheScene) {
  SensorFaultEvent drift;
  drift.sensor = "r_arm_ft";
  drift.drift[1] = 50;
  SceneEvent event;
  event.what = drift;
  RobotOnBrakes robot({event});
  robot.emulator->advance(1s);
  EXPECT_NEAR(robot.error(), 50, kReadingError);
  robot.inject({"ft-sign", "r_arm_ft", "axis=0"});
  robot.emulator->advance(2s);
  EXPECT_NEAR(robot.error(), 100, kReadingError);
  robot.emulator->clear_fault("r_arm_ft-ft-sign");
  robot.emulator->advance(3s);
  EXPECT_NEAR(robot.error(), 150, kReadingError);
}

TEST(InjectedNoise, IsDrawnFromThePlansSeedWhateverElseBreaks) {
  const auto readings = [](std::uint64_t seed, bool more) {
    RobotOnBrakes robot;
    faults::Injection noise = faults::parse_fault({"ft-noise", "r_arm_ft", "force=5"});
    noise.seed = seed;
    robot.emulator->inject(noise);
    std::vector<double> out;
    for (int i = 1; i <= 100; ++i) {
      if (more && i == 50) robot.inject({"ft-sign", "r_arm_ft", "axis=0"});
      if (more && i == 75) robot.emulator->clear_fault("r_arm_ft-ft-sign");
      robot.emulator->advance(std::chrono::milliseconds(i));
      out.push_back(robot.reading());
    }
    return out;
  };
  const std::vector<double> first = readings(1, false);
  EXPECT_EQ(first, readings(1, true));
  EXPECT_NE(first, readings(2, false));
}

TEST(InjectedNoise, HasTheDeviationAskedFor) {
  BreakableRobot rig(false);
  rig.run(3s);
  rig.emulator->inject(faults::parse_fault({"ft-noise", "r_arm_ft", "force=5", "torque=0.2"}));
  double forces = 0, torques = 0;
  constexpr int kSamples = 400;
  Wrench mean;
  std::vector<Wrench> all;
  for (int i = 0; i < kSamples; ++i) {
    rig.run(BreakableRobot::kCycle);
    all.push_back(rig.wrist());
    mean.force += all.back().force / kSamples;
    mean.torque += all.back().torque / kSamples;
  }
  for (const Wrench& one : all) {
    forces += (one.force - mean.force).squaredNorm() / (3 * kSamples);
    torques += (one.torque - mean.torque).squaredNorm() / (3 * kSamples);
  }
  // 1200 values determine their deviation to 2 %; the sensor's own noise adds 0.1 %.
  EXPECT_NEAR(std::sqrt(forces), 5, 0.4);
  EXPECT_NEAR(std::sqrt(torques), 0.2, 0.016);
}

TEST(InjectedCameraFault, IsInTheFrames) {
  BreakableRobot rig(false);
  MultiSense& camera = rig.emulator->camera();
  const auto frame = [&] {
    rig.run(200ms);
    MultiSense::Frame out;
    camera.render(camera.exposure(), false, out);
    return out;
  };
  const auto matched = [](const MultiSense::Frame& f) {
    return std::count_if(f.disparity.pixels.begin(), f.disparity.pixels.end(), [](auto d) { return d > 0; });
  };
  const auto sound = matched(frame());
  rig.emulator->inject(faults::parse_fault({"cloud-dropout", "share=0.25"}));
  EXPECT_NEAR(static_cast<double>(matched(frame())) / static_cast<double>(sound), 0.75, 0.02);
  rig.emulator->clear_fault("cloud-dropout");
  const Eigen::Isometry3d X_WC = camera.exposure().X_WC;
  rig.emulator->inject(faults::parse_fault({"extrinsic-error", "shift=0.02", "turn=0.1"}));
  static_cast<void>(frame());
  const Eigen::Isometry3d X_CF = X_WC.inverse() * camera.exposure().X_WC;
  EXPECT_NEAR(X_CF.translation().x(), 0.02, 2e-3);
  EXPECT_NEAR(Eigen::AngleAxisd(X_CF.linear()).angle(), 0.1, 2e-3);
  rig.emulator->clear_fault("extrinsic-error");
  rig.emulator->inject(faults::parse_fault({"plane-misfit", "tilt=0.05"}));
  static_cast<void>(frame());
  const Eigen::AngleAxisd nod((X_WC.inverse() * camera.exposure().X_WC).linear());
  EXPECT_NEAR(nod.angle() * nod.axis().x(), 0.05, 2e-3);
  rig.emulator->inject(faults::parse_fault({"phantom-points", "size=40", "distance=2"}));
  const MultiSense::Frame seen = frame();
  const sensors::StereoOptions& optics = camera.optics();
  const auto pixel = [&](int beside) {
    const int index = optics.height / 2 * optics.width + optics.width / 2 + beside;
    return seen.disparity.pixels[static_cast<std::size_t>(index)] / 16.0;
  };
  const double expected = optics.focal_px * optics.baseline / 2;
  EXPECT_NEAR(pixel(0), expected, 0.04);
  EXPECT_NEAR(pixel(19), expected, 0.04);
  EXPECT_GT(std::abs(pixel(-30) - expected), 1);
  rig.emulator->clear_fault("phantom-points");
  rig.emulator->inject(faults::parse_fault({"cloud-occlusion", "from=0.25", "to=0.5"}));
  const MultiSense::Frame hidden = frame();
  std::size_t in_gap = 0, beside = 0;
  for (std::size_t i = 0; i < hidden.disparity.pixels.size(); ++i) {
    const auto column = static_cast<int>(i) % optics.width;
    const bool gap = column >= optics.width / 4 && column < optics.width / 2;
    (gap ? in_gap : beside) += hidden.disparity.pixels[i] > 0 ? 1U : 0U;
  }
  EXPECT_EQ(in_gap, 0U);
  EXPECT_GT(beside, hidden.disparity.pixels.size() / 4);
  rig.emulator->clear_fault("cloud-occlusion");
  rig.emulator->inject(faults::parse_fault({"cloud-stale"}));
  const Exposure kept = camera.exposure();
  rig.run(500ms);
  EXPECT_GT(camera.exposure().frame, kept.frame);
  EXPECT_EQ(camera.exposure().stamp, kept.stamp);
  rig.emulator->clear_fault("cloud-stale");
  rig.run(200ms);
  EXPECT_GT(camera.exposure().stamp, kept.stamp);
  rig.emulator->inject(faults::parse_fault({"cloud-missing"}));
  const std::uint64_t last = camera.exposure().frame;
  rig.run(500ms);
  EXPECT_EQ(camera.exposure().frame, last);
}

}  // namespace
}  // namespace walkman
