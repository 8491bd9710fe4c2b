#include "apps/picture/run_to_phase.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "adaptation/regrasp/regrasp.h"

namespace walkman::apps {
namespace {

/// Ends a run from inside; not an error, so nothing on the way handles it as one.
struct MomentReached {};

/// Paces the method and waits for the moment to be reached.
class PhaseWatch : public robot::Cycle, public regrasp::Observer {
 public:
  PhaseWatch(Emulator& emulator, Time period, std::string phase, Time after)
      : cycle_(emulator, period), phase_(std::move(phase)), after_(after) {}

  Time next() override {
    const Time now = cycle_.next();
    if (due_ && now >= *due_) throw MomentReached{};
    return now;
  }
  void on_phase(std::string_view phase, Time now) override {
    if (std::find(seen_.begin(), seen_.end(), phase) == seen_.end()) seen_.emplace_back(phase);
    if (phase == phase_ && !due_) due_ = now + after_;
  }
  [[nodiscard]] const std::vector<std::string>& seen() const { return seen_; }

 private:
  LockstepCycle cycle_;
  std::string phase_;
  Time after_;
  std::optional<Time> due_;
  std::vector<std::string> seen_;
};

}  // namespace

void run_to_phase(EmulatedWorld& world, const robot::RobotOptions& robot_options,
                  const std::filesystem::path& parameters, const std::string& phase, Time after) {
  const MethodParameters method_parameters = load_method_parameters(parameters);
  require_fit(robot_options.layout, world.robot.devices);
  robot::Robot robot(world.robot.model, world.robot.devices, world.emulator.interfaces(), robot_options);
  PhaseWatch watch(world.emulator, robot_options.cycle, phase, after);
  std::string ending;
  try {
    EmbeddedCamera camera(world.emulator);
    regrasp::Regrasp method(world.robot, robot, watch, camera.client, method_parameters, watch);
    ending = regrasp::to_string(method.run().ending);
  } catch (const MomentReached&) {
    return;
  } catch (const regrasp::RunStopped& stop) {
    ending = stop.what();
  }
  throw std::runtime_error(
      fmt::format("the run ended ({}) before {} s of phase '{}' had passed, its phases were: {}", ending,
                  std::chrono::duration<double>(after).count(), phase, fmt::join(watch.seen(), ", ")));
}

}  // namespace walkman::apps
