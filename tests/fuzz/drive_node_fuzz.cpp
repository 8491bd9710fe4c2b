// Frames into a drive: NMT, SYNC, TIME, SDO, RPDOs, guarding, LSS, in any order, while its control loops run.

#include <cmath>

#include "emulator/nodes/drive/drive_node.h"
#include "tests/fuzz/node_talk.h"
#include "tests/unit/nodes/test_drive.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  constexpr double kStep = 2.5e-4;  // s
  constexpr int kMostSteps = 64;    // after one pause
  fuzz::Input input(data, size);
  const bool fd = (input.byte() & 7U) == 7;  // takes ten times as long to set up
  const nodes::DriveParameters parameters = nodes::test_drive();
  nodes::DriveNode drive(parameters);
  if (fd) drive.use_fd();
  drive.store_eds(std::string(300, 'e'));

  nodes::ServoFeedback feedback;  // a motor on a spring whose other end is fixed
  fuzz::talk_to(drive, input, fd, [&](Time pause) {
    const auto steps = static_cast<int>(std::chrono::duration<double>(pause).count() / kStep);
    for (int i = 0; i < std::min(steps, kMostSteps); ++i) {
      const double torque = drive.control(feedback, kStep);
      fuzz::require(std::isfinite(torque) && std::abs(torque) <= 1.001 * parameters.peak_torque,
                    "a drive's torque is within its power stage's");
      const double acceleration = (torque - feedback.spring_torque) / parameters.motor_inertia;
      feedback.motor_velocity = drive.brake_engaged() ? 0 : feedback.motor_velocity + acceleration * kStep;
      feedback.motor_position += feedback.motor_velocity * kStep;
      feedback.spring_torque = parameters.spring_constant * feedback.motor_position;
    }
  });
  return 0;
}
