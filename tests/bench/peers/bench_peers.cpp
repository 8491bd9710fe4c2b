// Time of a 1 ms step of the robot in Bullet, with the plant's own multibody, solver, velocity terms and
// wrench probes, and in MuJoCo with its default solver: same model, same torque law, the steps of both
// alternating in one thread. In both, the robot collides only with the ground, not with itself.
//
//   walkman-peer-bench [STEPS]

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "emulator/scene/scene.h"
#include "tests/bench/peers/step_times.h"
#include "tests/peers/twin.h"

namespace {

using namespace walkman;

constexpr int kWarmUp = 1000;  // steps in which the robot settles

/// A fixed amount of work that touches no memory: the spread of its time is due to the host.
void idle_loop() {
  volatile std::uint64_t sink = 0;
  std::uint64_t x = 88172645463325252ULL;
  for (int i = 0; i < 20000; ++i) {
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
  }
  sink = x;
  static_cast<void>(sink);
}

void print_row(const char* name, const peers::StepTimes& times) {
  std::printf("  %-10s %9.1f %9.1f %12.1f %9.1f\n", name, times.wall(0.5), times.wall(0.99),
              times.processor(0.5), times.processor(0.99));
}

/// Times both engines and returns whether both robots ended as the variant requires.
bool run(const char* title, peers::Twin& twin, int steps, bool standing) {
  for (int i = 0; i < kWarmUp; ++i) {
    twin.step_bullet();
    twin.step_mujoco();
  }
  peers::StepTimes bullet, mujoco, idle;
  for (int i = 0; i < steps; ++i) {
    bullet.time([&] { twin.step_bullet(); });
    mujoco.time([&] { twin.step_mujoco(); });
    idle.time(idle_loop);
  }
  std::printf("%s, %d joints, 4 wrenches, %d steps\n", title, static_cast<int>(twin.joints().size()), steps);
  std::printf("  %-10s %19s %22s\n", "", "wall clock, us", "processor time, us");
  std::printf("  %-10s %9s %9s %12s %9s\n", "", "median", "p99", "median", "p99");
  print_row("Bullet", bullet);
  print_row("MuJoCo", mujoco);
  print_row("idle loop", idle);
  std::printf("  Bullet / MuJoCo: median %.2f, p99 %.2f (processor time)\n",
              bullet.processor(0.5) / mujoco.processor(0.5), bullet.processor(0.99) / mujoco.processor(0.99));
  const double apart = (twin.bullet_state().p_WBcm - twin.mujoco_state().p_WBcm).norm();
  const int bullet_contacts = twin.bullet_contacts();
  const int mujoco_contacts = twin.mujoco_contacts();
  std::printf("  contacts %d and %d, base %.2f mm apart at the end\n\n", bullet_contacts, mujoco_contacts,
              1e3 * apart);
  if (!standing) return bullet_contacts == 0 && mujoco_contacts == 0;
  return bullet_contacts > 0 && mujoco_contacts > 0 && twin.bullet_state().p_WBcm.z() > 0.9 &&
         twin.mujoco_state().p_WBcm.z() > 0.9;
}

int run_all(int steps) {
  const Scene scene = load_scene(std::string(WALKMAN_URDF_DIR) + "/scenes/experiment_1.yaml");
  const RobotModel robot = load_robot_model(scene.robot.urdf);
  const DeviceTable devices = load_device_table(scene.robot.device_table, robot);
  peers::TwinOptions options;
  options.X_WR = scene.X_WB;
  options.mid_step_velocities = true;
  options.posture = load_posture(scene.robot.srdf, scene.posture, robot);
  peers::Twin hung(robot, devices, options);
  hung.hold_posture(robot, devices, 5);
  bool good = run("Fixed base, no contact", hung, steps, false);
  options.fixed_base = false;
  options.ground = true;
  peers::Twin stood(robot, devices, options);
  stood.hold_posture(robot, devices, 0);
  good = run("Standing on two soles", stood, steps, true) && good;
  std::printf("MuJoCo %s, Newton, pyramidal cone; Bullet %d, at most 50 sweeps in row space.\n",
              mj_versionString(), btGetVersion());
  if (!good) std::fputs("walkman-peer-bench: a robot fell or touched something\n", stderr);
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 5000;
  if (argc > 2 || steps < 100) {
    std::fputs("walkman-peer-bench: expected a number of steps, at least 100\n", stderr);
    return 2;
  }
  try {
    return run_all(steps);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "walkman-peer-bench: %s\n", e.what());
    return 5;
  }
}
