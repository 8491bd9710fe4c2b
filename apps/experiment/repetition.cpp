#include "apps/experiment/repetition.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "adaptation/regrasp/regrasp.h"
#include "apps/experiment/judge.h"
#include "apps/experiment/least_torque.h"
#include "apps/experiment/limit_watch.h"
#include "apps/experiment/repetition_watch.h"
#include "apps/picture/png_file.h"
#include "apps/picture/scene_painting.h"
#include "apps/shared/emulated_world.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/result_files.h"
#include "apps/shared/scene_reach.h"
#include "drivers/robot/robot.h"
#include "emulator/datasheets/device_files.h"
#include "emulator/emulator.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/logs/candump_log.h"
#include "emulator/logs/state_log.h"
#include "emulator/pacing/host.h"
#include "emulator/scene/error_report.h"
#include "urdf/reader/nearest_name.h"

namespace walkman::apps {
namespace {

constexpr Time kWatchedAfterStop = std::chrono::milliseconds(1500);  // long enough to fall over
constexpr PictureView kHeldView{-1.0, 0.25, 640, 480, 9, 1};

double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

WorldOptions world_options(const RepetitionOptions& options) {
  WorldOptions out;
  out.scene = options.scene;
  out.robot = options.robot_choice;
  out.actuators = options.actuators;
  out.model_error = options.model_error;
  out.faults = options.faults;
  out.seed = options.seed;
  out.within_reach = true;
  return out;
}

DrawnRobot drawn_robot(const DrawnWorld& world) {
  DrawnRobot out;
  out.model_error = world.scene.model_error.text();
  out.mass = world.truth.model.total_mass();
  for (const ErrorSummary& kind : summaries(world.truth.draws))
    out.kinds.push_back({name_of(kind.kind).key, kind.count, kind.rms, kind.largest, kind.of});
  return out;
}

/// Watches the buses: writes the CAN log and the state log.
class WireTap {
 public:
  WireTap(Emulator& emulator, const RepetitionOptions& options) {
    if (!options.out.empty()) {
      log_file_ = options.out / "can.log";
      state_file_ = options.out / "state.csv";
      const std::string note = faults::log_note(emulator.injections(), false);
      log_ = std::make_unique<bus::CandumpLog>(partial(log_file_), note);
      if (options.state_log) states_ = std::make_unique<datasheets::StateLog>(partial(state_file_), note);
    }
    for (bus::CanBus* bus : emulator.buses()) {
      if (log_) {
        bus->set_observer([this, bus](const can::StampedFrame& f) { log_->write(bus->interface_name(), f); });
      }
      if (states_) states_->watch(*bus);
    }
  }
  void cycle() {
    if (log_) log_->commit();
  }
  void finish() {
    if (log_) {
      log_->flush();
      publish(log_file_);
    }
    if (states_) {
      states_->flush();
      publish(state_file_);
    }
  }

 private:
  std::filesystem::path log_file_, state_file_;
  std::unique_ptr<bus::CandumpLog> log_;
  std::unique_ptr<datasheets::StateLog> states_;
};

/// The emulated clock, with observers who look whatever the control program does: boots, recovers or stalls.
class WatchedCycle : public LockstepCycle {
 public:
  WatchedCycle(Emulator& emulator, const RepetitionOptions& options, LimitWatch& limits)
      : LockstepCycle(emulator, options.robot.cycle),
        emulator_(emulator),
        limits_(limits),
        watch_(options.watch) {}

  /// `judge` must outlive the cycle's use.
  void observe(Judge& judge) { judge_ = &judge; }

 protected:
  void pass(Time time) override {
    for (const Time end = emulator_.now() + time; emulator_.now() < end;) {
      emulator_.advance(emulator_.now() + Emulator::kPhysicsStep);
      limits_.step();
    }
    if (judge_ != nullptr) judge_->watch_contacts();
    if (watch_ != nullptr) watch_->cycle();
  }

 private:
  Emulator& emulator_;
  LimitWatch& limits_;
  RepetitionWatch* watch_;
  Judge* judge_ = nullptr;
};

/// Names the buses that may have caused a stop: at full load the lowest priorities never get through.
std::string full_buses(Emulator& emulator) {
  constexpr double kFull = 0.97;
  std::string names;
  for (bus::CanBus* bus : emulator.buses()) {
    if (std::max(bus->load(), bus->recent_load()) >= kFull)
      names += (names.empty() ? "" : ", ") + bus->name();
  }
  return names.empty() ? names : "; buses at full load, so that frames are late or lost: " + names;
}

Outcome outcome_of(regrasp::Ending ending) {
  switch (ending) {
    case regrasp::Ending::kMinimumTorque:
      return Outcome::kMinimumTorque;
    case regrasp::Ending::kMinimumDisplacement:
      return Outcome::kMinimumDisplacement;
    case regrasp::Ending::kRegraspLimit:
      return Outcome::kRegraspLimit;
  }
  return Outcome::kStopped;
}

double reduction(double torque, double after) {
  return torque == 0 ? 0 : 100 * (1 - std::abs(after) / std::abs(torque));
}

/// Row of the weighings from `first` to before `end`, at least one.
JudgedRow judged_row(const Judge& judge, std::size_t first, std::size_t end) {
  const regrasp::Weighing &before = judge.weighings()[first], &after = judge.weighings()[end - 1];
  const TrueWeighing &truth = judge.true_weighings()[first], &truth_after = judge.true_weighings()[end - 1];
  JudgedRow out;
  out.row = {truth.d_r,
             truth.d_v,
             before.f_g,
             before.torque,
             before.displacement,
             after.torque,
             after.displacement,
             reduction(before.torque, after.torque),
             before.torque_about_handle,
             after.torque_about_handle,
             before.force_deviation,
             before.torque_deviation,
             after.torque_deviation,
             before.displacement_deviation,
             after.displacement_deviation,
             after.p_HCm.x(),
             after.p_HCm.y(),
             after.p_HCm.z()};
  out.truth = {truth.torque,
               truth.displacement,
               truth_after.torque,
               truth_after.displacement,
               truth_after.com_error,
               truth.torque_about_handle,
               truth_after.torque_about_handle,
               reduction(truth.torque, truth_after.torque),
               truth_after.slip,
               truth_after.slip_turn,
               truth_after.p_HCm.x(),
               truth_after.p_HCm.y(),
               truth_after.p_HCm.z(),
               judge.visual_com_error()};
  return out;
}

double true_com(const SceneObject& object) { return object.p_OOcm().x() - object.left_end; }

/// Result of a repetition whose true robot does not fit where the scene places it; rethrows `why` if that is
/// due to the scene and not to the draws.
RepetitionResult not_started(const RepetitionOptions& options, const plant::StartsInside& why) {
  const DrawnWorld world(world_options(options));
  if (world.truth.draws.empty()) throw plant::StartsInside(why);
  RepetitionResult result;
  result.seed = options.seed;
  result.robot = drawn_robot(world);
  result.row.d_r = true_com(world.scene.objects.front());
  result.reason = fmt::format("this robot, as it was drawn, has no room to start: {}", why.what());
  return result;
}

void fill_rows(const Scene& scene, const Judge& judge, RepetitionResult& result) {
  const std::vector<regrasp::Weighing>& weighings = judge.weighings();
  result.weighed = !weighings.empty();
  if (!result.weighed) {
    result.row.d_r = true_com(scene.objects[static_cast<std::size_t>(judge.object())]);
    if (!judge.grasp_positions().empty()) result.row.d_v = judge.grasp_positions().front();
    return;
  }
  const auto changed =
      std::find_if(weighings.begin(), weighings.end(), [](const auto& weighing) { return weighing.changed; });
  const auto change = static_cast<std::size_t>(changed - weighings.begin());
  const JudgedRow first = judged_row(judge, 0, change);
  result.row = first.row;
  result.truth = first.truth;
  if (change < weighings.size()) result.after_change = judged_row(judge, change, weighings.size());
  // A load that changes in the hand is weighed again without a regrasp.
  const auto in_hand = std::count_if(weighings.begin(), weighings.end(),
                                     [](const auto& weighing) { return weighing.in_hand; });
  result.regrasps = static_cast<int>(weighings.size()) - 1 - static_cast<int>(in_hand);
}

/// Settles the outcome of a method that came to its end: the plant decides whether its result is true.
void settle_outcome(const Judge& judge, const LimitWatch& limits, double displacement_threshold,
                    RepetitionResult& result) {
  if (!judge.always_held() || !judge.held_now()) {
    result.outcome = Outcome::kDropped;
    return;
  }
  const auto reason =
      contradiction(judge.weighings().back(), judge.true_weighings().back(), displacement_threshold);
  if (reason) {
    result.outcome = Outcome::kWrong;
    result.reason = *reason;
  } else if (!judge.touches().empty()) {
    result.outcome = Outcome::kCollided;
    result.reason = to_string(judge.touches().front());
  } else if (!limits.passed().empty()) {
    result.outcome = Outcome::kOverloaded;
    result.reason = to_string(limits.passed().front());
  }
}

/// Adds to a stop's reason the damage that it did not prevent.
void tell_damage(const Judge& judge, const LimitWatch& limits, RepetitionResult& result) {
  if (result.outcome != Outcome::kStopped) return;
  if (!judge.touches().empty()) {
    result.reason += "; " + to_string(judge.touches().front());
  } else if (!limits.passed().empty()) {
    result.reason += "; " + to_string(limits.passed().front());
  }
}

/// Completes files, each regardless of the others; keeps the first reason why one could not be.
class Files {
 public:
  void complete(const std::function<void()>& finish) {
    try {
      finish();
    } catch (const std::runtime_error& e) {
      if (unwritten_.empty()) unwritten_ = e.what();
    }
  }
  [[nodiscard]] const std::string& unwritten() const { return unwritten_; }

 private:
  std::string unwritten_;
};

/// Rejects phases that the method does not have: what waits for one would never happen.
template <typename Waiting>
void require_phases(const std::vector<Waiting>& all, const char* list) {
  const std::vector<std::string> names(regrasp::kPhaseNames.begin(), regrasp::kPhaseNames.end());
  for (const Waiting& one : all) {
    if (!one.phase || std::find(names.begin(), names.end(), one.phase->phase) != names.end()) continue;
    throw std::runtime_error(
        fmt::format("{}: {} in_phase.phase: there is no phase \"{}\"{}, expected one of {}", one.where, list,
                    one.phase->phase, did_you_mean(one.phase->phase, names), fmt::join(names, ", ")));
  }
}

}  // namespace

std::string to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kMinimumTorque:
      return "minimum torque";
    case Outcome::kMinimumDisplacement:
      return "minimum displacement";
    case Outcome::kRegraspLimit:
      return "regrasp limit";
    case Outcome::kDropped:
      return "dropped";
    case Outcome::kWrong:
      return "wrong";
    case Outcome::kCollided:
      return "collided";
    case Outcome::kOverloaded:
      return "limit exceeded";
    case Outcome::kStopped:
      return "stopped";
  }
  return "unknown";
}

void require_valid(const RepetitionOptions& options) {
  const Scene scene = load_scene(options.scene, options.robot_choice.packages);
  require_phases(scene.events, "events");
  const KnownRobot robot(scene.robot, options.robot_choice);
  require_reach(scene, robot.model);
  require_fit(options.robot.layout, robot.devices);
  if (!options.faults.empty()) {
    const std::vector<faults::Injection> plan = faults::load_fault_plan(options.faults);
    require_phases(plan, "faults");
    for (const faults::Injection& injection : plan)
      faults::require_target(injection, faults::known_targets(robot.model, robot.devices, scene));
  }
  static_cast<void>(load_method_parameters(options.parameters));
}

RepetitionResult run_repetition(const RepetitionOptions& options) {
  std::optional<EmulatedWorld> started;
  try {
    started.emplace(world_options(options));
  } catch (const plant::StartsInside& why) {
    return not_started(options, why);
  }
  EmulatedWorld& world = *started;
  const MethodParameters parameters = load_method_parameters(options.parameters);
  std::error_code folder_error;
  if (!options.out.empty()) std::filesystem::create_directories(options.out, folder_error);
  if (folder_error) throw EnvironmentError(options.out.string() + ": " + folder_error.message());
  require_fit(options.robot.layout, world.robot.devices);
  robot::RobotOptions robot_options = options.robot;
  robot_options.allow_overload = true;  // the emulated buses show the consequences
  robot::Robot robot(world.robot.model, world.robot.devices, world.emulator.interfaces(), robot_options);
  LimitWatch limits(world, options.actuators / "../../nodes/measuring");
  WatchedCycle cycle(world.emulator, options, limits);
  WireTap tap(world.emulator, options);
  if (options.prepare) options.prepare(world.emulator);

  const Time start = pacing::host_now();
  Progress progress;
  const auto report_progress = [&](Time now) {
    progress.simulated_seconds = seconds(now);
    progress.real_time_factor = progress.simulated_seconds / seconds(pacing::host_now() - start);
    if (options.progress) options.progress(progress);
  };
  std::optional<Snapshot> held;
  Judge judge(
      world.emulator, world.scene, world.robot,
      [&](std::string_view phase) {
        if (options.watch != nullptr) options.watch->phase_begins(phase);
        world.emulator.begin_phase(phase);
        progress.phase = phase;
        if (!options.out.empty() && !held && phase == regrasp::to_string(regrasp::Phase::kWatch))
          held = take_snapshot(world);
        report_progress(world.emulator.now());
      },
      [&](Time now) {
        tap.cycle();
        report_progress(now);
      },
      [&](std::string_view sentence) {
        if (options.watch != nullptr) options.watch->warned(sentence);
        if (options.warned) options.warned(sentence);
      });
  cycle.observe(judge);
  Files files;
  if (options.watch != nullptr) options.watch->begins(world, robot, judge, limits);
  if (!options.out.empty()) {
    judge.trace_to(options.out / "wrench.csv", faults::log_note(world.emulator.injections(), false));
    judge.keep_cloud(options.out / "cloud.pcd", options.out / "seen.png");
    files.complete([&] {
      write_whole(options.out / "model_error.yaml",
                  to_yaml(world.truth, world.scene.model_error, world.scene.seed));
    });
  }

  RepetitionResult result;
  result.seed = options.seed;
  result.robot = drawn_robot(world);
  try {
    EmbeddedCamera camera(world.emulator);
    regrasp::Regrasp method(world.robot, robot, cycle, camera.client, parameters, judge);
    const regrasp::Report report = method.run();
    result.outcome = outcome_of(report.ending);
    result.reason = report.hindrance;
    settle_outcome(judge, limits, parameters.stage_two.displacement_threshold, result);
  } catch (const regrasp::RunStopped& stop) {
    result.outcome = Outcome::kStopped;
    result.reason = stop.what() + full_buses(world.emulator);
  } catch (const std::exception& e) {
    throw std::logic_error(fmt::format("seed {}, {:.3f} s, {}: {}", options.seed,
                                       seconds(world.emulator.now()), progress.phase, e.what()));
  }
  if (!options.out.empty()) {
    // With the PDOs as the master configured them at boot.
    files.complete([&] {
      static_cast<void>(
          datasheets::write_dbc_files(datasheets::wired_buses(world.robot.devices, world.emulator.buses()),
                                      partial(options.out / "dbc")));
      publish_folder(options.out / "dbc");
    });
  }
  if (held) {
    files.complete([&] {
      ScenePainting painting;
      paint_scene(world, *held, painting);
      write_png(portrait(painting, kHeldView), partial(options.out / "held.png"));
      publish(options.out / "held.png");
    });
  }
  robot.stop();
  cycle.next();  // the drives perform their quick stop, and their brakes hold
  files.complete([&] { judge.finish(); });
  files.complete([&] { tap.finish(); });
  result.unwritten = files.unwritten();
  report_progress(world.emulator.now());
  fill_rows(world.scene, judge, result);
  if (judge.always_held() && result.outcome != Outcome::kStopped) {
    SceneObject object = world.emulator.plant().object(judge.object());  // with its present weights
    result.least_torque = least_torque(world.scene, object, world.robot, robot.joint_names(), parameters);
  }
  for (const faults::InjectionState& state : world.emulator.injections())
    result.faults.push_back({state.injection.name, std::string(state.injection.kind->name),
                             state.injection.target, state.times, state.touched, seconds(state.first)});
  result.recoveries = static_cast<int>(judge.recovered_from().size());
  result.warnings = judge.warnings();
  result.simulated_seconds = progress.simulated_seconds;
  if (options.watch != nullptr) {
    options.watch->over(result, cycle);
  } else if (result.outcome == Outcome::kStopped) {
    const Time end = world.emulator.now() + kWatchedAfterStop;
    while (world.emulator.now() < end) cycle.next();
  }
  tell_damage(judge, limits, result);
  for (const UnwantedTouch& touch : judge.touches()) result.touches.push_back(to_string(touch));
  for (const PassedLimit& passed : limits.passed()) result.limits.push_back(to_string(passed));
  return result;
}

}  // namespace walkman::apps
