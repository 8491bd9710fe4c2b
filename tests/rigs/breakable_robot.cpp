#include "tests/rigs/breakable_robot.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "drivers/robot/pdo_layout.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::rigs {

using namespace std::chrono_literals;

BreakableRobot::BreakableRobot(bool moves, const char* layout) : moving(moves) {
  emulator.emplace(model, devices, scene, options);
  robot::RobotOptions master;
  master.identities = robot::load_identities(tree / "urdf/walkman.identities.yaml");
  if (layout != nullptr) master.layout = robot::load_pdo_layout(tree / "urdf/pdo_layouts" / layout);
  robot.emplace(model, devices, emulator->interfaces(), master);
  emulator->advance(kCycle);
  while (!robot->boot(emulator->now())) emulator->advance(emulator->now() + kCycle);
  static_cast<void>(robot->read(emulator->now()));
  for (const auto& joint : robot->joints()) start.push_back(joint.link_position);
  began = emulator->now();
  run(500ms);
}

Time BreakableRobot::run(Time limit) {
  const Time from = emulator->now();
  std::vector<robot::JointCommand> commands(start.size());
  while (emulator->now() - from < limit && !robot->fault()) {
    const double t = std::chrono::duration<double>(emulator->now() - began).count();
    for (std::size_t i = 0; i < commands.size(); ++i)
      commands[i].link_position = start[i] + (moving && robot->joint_names()[i].starts_with("R") &&
                                                      (robot->joint_names()[i] == "RShSag" ||
                                                       robot->joint_names()[i].starts_with("RElb") ||
                                                       robot->joint_names()[i].starts_with("RWr"))
                                                  ? 0.1 * std::sin(2 * std::numbers::pi * 0.5 * t)
                                                  : 0);
    robot->write(commands);
    told = commands;
    robot->sync(emulator->now());
    emulator->advance(emulator->now() + kCycle);
    if (const Time stall = emulator->take_stall(); stall > Time{}) emulator->advance(emulator->now() + stall);
    static_cast<void>(robot->read(emulator->now()));
    for (const std::string& warning : robot->new_warnings()) warnings.push_back(warning);
  }
  return emulator->now() - from;
}

double BreakableRobot::swing_after_stop() {
  robot->stop();
  emulator->advance(emulator->now() + 1s);
  std::vector<double> least = positions(), most = least;
  for (const Time end = emulator->now() + 1s; emulator->now() < end;) {
    emulator->advance(emulator->now() + kCycle);
    const std::vector<double> now = positions();
    for (std::size_t i = 0; i < now.size(); ++i) {
      least[i] = std::min(least[i], now[i]);
      most[i] = std::max(most[i], now[i]);
    }
  }
  double swing = 0;
  for (std::size_t i = 0; i < least.size(); ++i) swing = std::max(swing, most[i] - least[i]);
  return swing;
}

bool BreakableRobot::on_brakes() {
  const std::vector<double> before = motors();
  emulator->inject(faults::parse_fault({"push", "RForearm", "y=200", "for=0.5"}));
  emulator->advance(emulator->now() + 400ms);
  return motors() == before;
}

std::vector<double> BreakableRobot::motors() const {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(emulator->plant().drive_count()));
  for (int i = 0; i < emulator->plant().drive_count(); ++i)
    out.push_back(emulator->plant().readings(i).motor_position);
  return out;
}

std::vector<double> BreakableRobot::positions() const {
  std::vector<double> out;
  for (const std::string& name : robot->joint_names())
    out.push_back(emulator->plant().joint_position(model.joint_index(name)));
  return out;
}

double BreakableRobot::farthest_astray() const {
  const std::vector<double> now = positions();
  double most = 0;
  for (std::size_t i = 0; i < told.size(); ++i)
    most = std::max(most, std::abs(now[i] - told[i].link_position));
  return most;
}

Wrench BreakableRobot::wrist() const {
  const auto& names = robot->sensor_names();
  const auto place = std::find(names.begin(), names.end(), "r_arm_ft") - names.begin();
  return robot->sensors()[static_cast<std::size_t>(place)].F_So_S;
}

}  // namespace walkman::rigs
