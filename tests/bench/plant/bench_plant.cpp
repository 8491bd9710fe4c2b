// Time of a one-millisecond step of the plant on one core: median and 99th percentile, compared with the time
// that the host takes from an idle loop, measured alternately with it.
//   walkman-bench-plant [STEPS [contact-free|standing|lift|both-grip]]

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/bench/plant/plant_scenes.h"
#include "tests/rigs/commanded_robot.h"

namespace {

using Clock = std::chrono::steady_clock;

double microseconds(Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

/// Longest time between two clock readings of a loop that does nothing else for `us` microseconds.
double idle_gap(double us) {
  const auto begin = Clock::now();
  auto last = begin;
  double longest = 0;
  while (microseconds(last - begin) < us) {
    const auto now = Clock::now();
    longest = std::max(longest, microseconds(now - last));
    last = now;
  }
  return longest;
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Times steps one by one, with idle loops in between.
struct Timing {
  std::vector<double> us, gaps;
  void step(const std::function<void()>& step) {
    const auto begin = Clock::now();
    step();
    us.push_back(microseconds(Clock::now() - begin));
    if (us.size() % 10 == 1) gaps.push_back(idle_gap(us.back()));
  }
};

void print(const char* name, double target_us, const walkman::plant::Plant& plant, const Timing& timing) {
  const auto& [us, gaps] = timing;
  const double median = percentile(us, 0.5);
  std::printf("%-13s %8zu %10.1f %10.1f %12.1f %12.1f", name, plant.contacts().size(), median,
              percentile(us, 0.99), percentile(gaps, 0.5), percentile(gaps, 0.99));
  if (target_us > 0) {
    std::printf(" %9.0f %7.2f\n", target_us, median / target_us);
  } else {
    std::printf(" %9s %7s\n", "-", "-");
  }
}

void measure(const char* name, double target_us, int steps, const walkman::plant::Plant& plant,
             const std::function<void()>& step) {
  Timing timing;
  for (int i = 0; i < steps; ++i) timing.step(step);
  print(name, target_us, plant, timing);
}

/// The robot on its feet with the bar in its right hand in the air: first the step of the whole emulator,
/// with drives, sensors and buses; then the step of the plant alone, which continues from there with its
/// brakes closed and both hands' motors pulling.
void measure_lift(const walkman::bench::PlantScenes& scenes, double target_us, int steps) {
  using namespace walkman;
  constexpr double kRadius = 0.035;  // m, of the bar
  EmulatorOptions options;
  options.actuators = std::string(WALKMAN_URDF_DIR) + "/../emulator/plant/actuators";
  rigs::CommandedRobot robot(load_scene(std::string(WALKMAN_URDF_DIR) + "/scenes/experiment_1.yaml"),
                             options);
  robot.start();
  const Eigen::Isometry3d X_TG = robot.X_TG_on_top(0, kRadius);
  robot.grasp(X_TG, kRadius);
  robot.manipulator().lift();
  Timing timing;
  robot.cycle().each_step = [&](const std::function<void()>& step) { timing.step(step); };
  robot.manipulator().hold(steps * 1e-3);
  print("lift, whole", 0, robot.plant(), timing);
  auto& plant = const_cast<plant::Plant&>(robot.plant());  // only here: the drivers are not used any more
  const auto step = [&] { scenes.step(plant, walkman::bench::PlantScenes::kGrip); };
  for (int i = 0; i < 500; ++i) step();
  measure("lift", target_us, steps, plant, step);
  if (!plant.slip(0, 0).held && !plant.slip(1, 0).held) throw std::runtime_error("the bar was not held");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string only = argc > 2 ? argv[2] : "";
    const std::array<const char*, 4> known{"contact-free", "standing", "lift", "both-grip"};
    if (!only.empty() && std::find(known.begin(), known.end(), only) == known.end()) {
      std::fprintf(stderr, "scene '%s', expected contact-free, standing, lift or both-grip\n", only.c_str());
      return 2;
    }
    const int steps = argc > 1 ? std::max(100, std::atoi(argv[1])) : 3000;
    const walkman::bench::PlantScenes scenes(WALKMAN_URDF_DIR);
    std::printf(
        "one step of 1 ms, us; idle: longest gap in a loop that only reads the clock, as long as a step\n");
    std::printf("%-13s %8s %10s %10s %12s %12s %9s %7s\n", "scene", "contacts", "median", "p99",
                "idle median", "idle p99", "target", "ratio");
    const auto wanted = [&](const char* name) { return only.empty() || only == name; };
    const auto time = [&](const char* name, double target_us, std::unique_ptr<walkman::plant::Plant> plant,
                          double grip) {
      measure(name, target_us, steps, *plant, [&] { scenes.step(*plant, grip); });
    };
    if (wanted("contact-free")) time("contact-free", 0, scenes.contact_free(), 0);
    if (wanted("standing")) time("standing", 200, scenes.standing(), 0);
    if (wanted("lift")) measure_lift(scenes, 330, steps);
    if (wanted("both-grip")) time("both-grip", 0, scenes.gripping(), walkman::bench::PlantScenes::kGrip);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
