// Many lifts of a bar of random mass and centre of mass by the robot on its own feet, judged by ground truth.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/lifts/lift.h"

namespace walkman::lifts {
namespace {

constexpr double kLeastMass = 1.2, kMostMass = 1.8;  // kg
constexpr double kMostOffset = 0.12;                 // m

// Required bounds.
constexpr double kForceError = 1e-3;     // of the true wrench
constexpr double kLineError = 0.5e-3;    // m, of the true wrench
constexpr double kReadLineError = 3e-3;  // m, as read, in 95 of 100
constexpr double kPercentile = 0.95;

std::vector<LiftCase> draw(int count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> mass(kLeastMass, kMostMass), offset(-kMostOffset, kMostOffset);
  std::vector<LiftCase> cases;
  for (int i = 0; i < count; ++i) {
    LiftCase lift;
    lift.mass = mass(generator);
    lift.offset = offset(generator);
    lift.seed = generator();
    cases.push_back(lift);
  }
  return cases;
}

std::vector<LiftResult> run(const std::vector<LiftCase>& cases, const Scene& scene,
                            const EmulatorOptions& options, int jobs) {
  std::vector<LiftResult> results(cases.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++)
      results[i] = run_lift(scene, options, cases[i]);
  };
  std::vector<std::jthread> workers;
  for (int i = 1; i < jobs; ++i) workers.emplace_back(work);
  work();
  return results;
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto place = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  return values[place - 1];
}

/// Prints the table; returns true if everything held.
bool report(const std::vector<LiftCase>& cases, const std::vector<LiftResult>& results) {
  fmt::print("{:>8} {:>9} {:>5} {:>10} {:>9} {:>12} {:>11} {:>8}\n", "mass kg", "offset mm", "held",
             "f_z err %", "line mm", "read f_z %", "read line mm", "slip um");
  double worst_force = 0, worst_line = 0;
  std::vector<double> read;
  int held = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const LiftResult& r = results[i];
    fmt::print("{:8.3f} {:9.1f} {:>5} {:10.4f} {:9.3f} {:12.3f} {:11.2f} {:8.1f} {}\n", cases[i].mass,
               1e3 * cases[i].offset, r.held ? "yes" : "NO", 100 * r.force_error, 1e3 * r.line_error,
               100 * r.read_force_error, 1e3 * r.read_line_error, 1e6 * r.slip, r.reason);
    held += r.held ? 1 : 0;
    worst_force = std::max(worst_force, std::abs(r.force_error));
    worst_line = std::max(worst_line, r.line_error);
    read.push_back(r.reason.empty() ? r.read_line_error : 1);
  }
  const double most = percentile(read, kPercentile);
  fmt::print(
      "{} of {} held; by the true wrench f_z within {:.4f} % and the line within {:.3f} mm; as read the line "
      "within {:.2f} mm in {:.0f} %\n",
      held, results.size(), 100 * worst_force, 1e3 * worst_line, 1e3 * most, 100 * kPercentile);
  return held == static_cast<int>(results.size()) && worst_force <= kForceError && worst_line <= kLineError &&
         most <= kReadLineError;
}

}  // namespace
}  // namespace walkman::lifts

int main(int argc, char** argv) {
  using namespace walkman;
  CLI::App app{
      "walkman-lifts: lifts bars of random mass (1.2 to 1.8 kg) and centre of mass (up to 12 cm off the "
      "grasp) with "
      "the robot on its own feet, and judges every weighing by ground truth. Exit code 0 when all is within "
      "bounds."};
  const std::string tree = WALKMAN_SOURCE_TREE;
  std::string scene_file = tree + "/urdf/scenes/experiment_1.yaml";
  int count = 32, jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::uint64_t seed = 1;
  std::string errors = "noise";
  app.add_option("--count", count, "Lifts")->check(CLI::Range(1, 10000));
  app.add_option("--seed", seed, "Of the draws");
  app.add_option("--jobs", jobs, "Lifts at a time (default: one a core)")->check(CLI::Range(1, 256));
  app.add_option("--sensor-errors", errors,
                 "What the reading has: noise and resolution, as judged (noise), or cross-talk, residuals "
                 "and drift as well (all)")
      ->check(CLI::IsMember({"noise", "all"}));
  app.add_option("--scene", scene_file, "Scene with robot, table and bar");
  CLI11_PARSE(app, argc, argv);
  try {
    EmulatorOptions options;
    options.actuators = tree + "/emulator/plant/actuators";
    options.sensor_errors = errors == "all" ? SensorErrors::kAll : SensorErrors::kNoiseAndResolution;
    const auto cases = lifts::draw(count, seed);
    return lifts::report(cases, lifts::run(cases, load_scene(scene_file), options, jobs)) ? 0 : 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "walkman-lifts: {}\n", e.what());
    return 2;
  }
}
