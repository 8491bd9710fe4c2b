#include "tests/rigs/commanded_robot.h"

#include <stdexcept>
#include <utility>

namespace walkman::rigs {

Time SteppedCycle::next() {
  const Time end = emulator_.now() + period_;
  const auto step = [this] { emulator_.advance(emulator_.now() + Emulator::kPhysicsStep); };
  while (emulator_.now() < end) {
    if (each_step)
      each_step(step);
    else
      step();
  }
  return emulator_.now();
}

namespace {

RobotModel changed(RobotModel model, const std::function<void(RobotModel&)>& change) {
  if (change) change(model);
  return model;
}

}  // namespace

CommandedRobot::CommandedRobot(Scene scene, const EmulatorOptions& emulator,
                               const std::function<void(RobotModel&)>& truth)
    : scene_(std::move(scene)),
      known_(scene_.robot),
      true_model_(changed(known_.model, truth)),
      emulator_(true_model_, known_.devices, scene_, emulator),
      robot_(known_.model, known_.devices, emulator_.interfaces()),
      cycle_(emulator_, robot::RobotOptions{}.cycle),
      session_(known_, robot_, cycle_, *this),
      manipulator_(known_, session_, {}) {}

void CommandedRobot::start() {
  session_.boot();
  manipulator_.start();
}

void CommandedRobot::grasp(const Eigen::Isometry3d& X_TG, double radius, const std::function<void()>& over) {
  const StageTwoParameters parameters;
  const std::vector<Eigen::Isometry3d> way =
      regrasp::approach_way(X_TG, parameters.palm_clearance, parameters);
  manipulator_.approach({way[0], way[1]});
  if (over) over();
  manipulator_.descend(way[2]);
  manipulator_.grasp(radius, Eigen::AlignedBox3d(Eigen::Vector3d(-0.5, -2 * radius, -radius),
                                                 Eigen::Vector3d(0.5, 0, radius)));
}

void CommandedRobot::abandon(bool stop, Time period) {
  if (stop) robot_.stop();
  emulator_.advance(emulator_.now() + period);
}

double CommandedRobot::seconds() const { return std::chrono::duration<double>(emulator_.now()).count(); }

int CommandedRobot::sensor(const std::string& frame) const {
  int place = 0;
  for (const Bus& bus : known_.devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind != DeviceKind::kForceTorque) continue;
      if (device.name == frame) return place;
      ++place;
    }
  }
  throw std::runtime_error("no force/torque sensor '" + frame + "'");
}

Eigen::Isometry3d CommandedRobot::X_TG_on_top(int object, double height) const {
  const Eigen::Isometry3d X_TO = X_WT_.inverse() * plant().X_WO(object);
  const Eigen::Vector3d right = X_TO.linear().col(0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Isometry3d X_TG = Eigen::Isometry3d::Identity();
  X_TG.linear() << right, up, right.cross(up);
  X_TG.translation() = X_TO.translation() + height * up;
  return X_TG;
}

Eigen::Vector3d CommandedRobot::p_Wcm() const {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double mass = 0;
  for (std::size_t i = 0; i < true_model_.links.size(); ++i) {
    const Link& link = true_model_.links[i];
    moment += link.mass * (plant().X_WL(static_cast<int>(i)) * link.p_LLcm);
    mass += link.mass;
  }
  return moment / mass;
}

void CommandedRobot::on_stance(bool stands, const Eigen::Isometry3d& X_TB) {
  constexpr int kRootLink = 0;
  stands_ = stands;
  X_WT_ = plant().X_WL(kRootLink) * X_TB.inverse();
}

void CommandedRobot::on_cycle(Time, const Wrench&, const Eigen::Isometry3d&) {
  if (each_cycle) each_cycle();
}

}  // namespace walkman::rigs
