#pragma once

#include <cmath>
#include <stdexcept>

#include "tests/fuzz/input.h"
#include "tests/unit/drivers/layout_rig.h"

namespace walkman::fuzz {

/// A robot with two buses whose devices answer correctly, with frames from elsewhere in between.
class MasterTalk {
 public:
  static constexpr int kMostCycles = 400;

  /// `before`: called in each cycle before the devices and the master run; it may inject frames. Continues
  /// until `before` returns false, or for `kMostCycles`. Begins with a boot; recovers from faults.
  template <typename Before>
  void run(const Before& before) {
    bool running = false, faulty = false;
    for (int cycle = 0; cycle < kMostCycles && before(running); ++cycle) {
      rig.now += rig.options.cycle;
      rig.rarm.tick(rig.now);
      rig.torso.tick(rig.now);
      try {
        if (running && !faulty) {
          faulty = !rig.robot->read(rig.now);
          if (cycle % 2 == 0) rig.robot->write({{0.001 * cycle, 1}, {-0.001 * cycle, -1}});
          rig.robot->write_hand(0, 0.002 * cycle, 0.5);
          rig.robot->sync(rig.now);
        } else if (running ? rig.robot->recover(rig.now) : rig.robot->boot(rig.now)) {
          running = true;
          faulty = !rig.robot->read(rig.now);
          rig.robot->sync(rig.now);
        }
      } catch (const std::runtime_error& failed) {
        require_words(failed.what());
        if (!running) return;  // a failed boot is reported and ends the run
      }
      check();
    }
  }

  test::LayoutRig rig{"a"};

 private:
  static void require_words(const std::string& text) {
    require(!text.empty() && text.find('\n') == std::string::npos, "a failure is one sentence");
  }
  void check() {
    for (const cia402::DriveSample& joint : rig.robot->joints())
      require(std::isfinite(joint.motor_position) && std::isfinite(joint.motor_velocity) &&
                  std::isfinite(joint.link_position) && std::isfinite(joint.torque),
              "a joint's state is finite");
    for (const cia404::ForceTorqueSample& sensor : rig.robot->sensors())
      require(sensor.F_So_S.force.allFinite() && sensor.F_So_S.torque.allFinite(), "a wrench is finite");
    if (rig.robot->fault()) require_words(rig.robot->fault()->text);
    for (const std::string& warning : rig.robot->new_warnings()) require_words(warning);
    for (test::FakeBus* bus : {&rig.rarm, &rig.torso}) {
      for (const can::Frame& frame : bus->sent)
        require(frame.length <= 8 && !frame.extended && !frame.error,
                "a master sends what its bus can carry");
      bus->sent.clear();
    }
  }
};

}  // namespace walkman::fuzz
