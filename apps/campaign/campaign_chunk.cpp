#include "apps/campaign/campaign_chunk.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <oneapi/tbb/global_control.h>
#include <unistd.h>

#include "apps/campaign/supervised_child.h"
#include "apps/campaign/truth_watch.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "emulator/scene/scene.h"

namespace walkman::apps {
namespace {

constexpr double kWallPerCpu = 6;  // other processes need the cores as well

using How = ChildEnd::How;

RepetitionOptions options_of(const CampaignPlan& plan, const Twin& twin, const std::filesystem::path& data) {
  RepetitionOptions options;
  const Scene scene = load_scene(twin.scene);
  options.scene = twin.scene;
  options.seed = twin.seed;
  options.robot = load_robot_options({plan.layout, std::nullopt}, scene.robot);
  options.parameters = parameters_file(scene, data);
  options.actuators = data / "emulator" / "plant" / "actuators";
  if (!plan.model_error.empty()) options.model_error = plan.model_error;
  return options;
}

/// Thrown in the parent when nothing is left to fork: the twin has done its part. Not a std::exception,
/// because it is not an error.
struct AllForked {};

/// The watch of the twin and, in a forked child, of the run.
class ForkingWatch : public TruthWatch {
 public:
  /// `write_end` writes the record of a run whose child did not finish.
  ForkingWatch(const GoldenTrace& golden, std::vector<const CampaignRun*> waiting, const ChildLimits& limits,
               std::function<void(const CampaignRun&, const ChildEnd&)> write_end)
      : TruthWatch(&golden),
        waiting_(std::move(waiting)),
        limits_(limits),
        write_end_(std::move(write_end)) {}

  void phase_begins(std::string_view phase) override {
    TruthWatch::phase_begins(phase);
    if (run_ != nullptr) return;
    const int times = ++times_[std::string(phase)];
    while (!waiting_.empty()) {
      const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const CampaignRun* run) {
        return run->fault.phase->phase == phase && run->fault.phase->occurrence == times;
      });
      if (found == waiting_.end()) return;
      if (observation().differs) throw AllForked{};
      const CampaignRun* run = *found;
      ChildEnd end;
      for (int attempt = 0; attempt < 2 && (attempt == 0 || end.how == How::kKilled); ++attempt) {
        if (!fork_and_wait(limits_, end)) continue;
        run_ = run;
        world().emulator.inject(run->fault);
        return;
      }
      if (end.how == How::kLacking) throw RunLacked();
      if (end.how == How::kEndedFrom) throw EnvironmentError("a run was ended from outside: " + end.text);
      write_end_(*run, end);
      waiting_.erase(found);
    }
    throw AllForked{};
  }

  /// Returns the run that this process executes; null for the twin.
  [[nodiscard]] const CampaignRun* run() const { return run_; }

 private:
  std::vector<const CampaignRun*> waiting_;
  ChildLimits limits_;
  std::function<void(const CampaignRun&, const ChildEnd&)> write_end_;
  const CampaignRun* run_ = nullptr;
  std::map<std::string, int> times_;
};

class ChunkRunner {
 public:
  ChunkRunner(const CampaignFolder& folder, const CampaignChunk& chunk)
      : folder_(folder),
        chunk_(chunk),
        options_(options_of(folder.plan(), folder.plan().twins[chunk.twin], data_directory())),
        robot_(load_scene(options_.scene).robot),
        limits_{folder.plan().time_limit, kWallPerCpu * folder.plan().time_limit} {}

  void run() {
    run_golden();
    std::vector<const CampaignRun*> waiting = missing();
    if (waiting.empty()) return;
    golden_ = observation_from_json(nlohmann::json::parse(std::ifstream(folder_.golden(chunk_.twin))));
    settle_without_running(waiting);
    if (!waiting.empty()) run_twin(waiting);
    waiting = missing();
    // The golden twin reached the phases of these runs, and this one did not.
    for (const CampaignRun* run : waiting) invalid(*run, "the golden twin was not reproduced");
  }

 private:
  [[nodiscard]] std::vector<const CampaignRun*> missing() const {
    std::vector<const CampaignRun*> out;
    for (std::size_t i = chunk_.first; i < chunk_.first + chunk_.count; ++i) {
      const CampaignRun& run = folder_.plan().runs[i];
      if (!std::filesystem::exists(folder_.record(run.number))) out.push_back(&run);
    }
    return out;
  }

  void run_golden() {
    if (std::filesystem::exists(folder_.golden(chunk_.twin))) return;
    ChildEnd end;
    if (fork_and_wait(limits_, end)) {
      end_child([&] {
        TruthWatch watch(nullptr);
        RepetitionOptions options = options_;
        options.watch = &watch;
        static_cast<void>(run_repetition(options));
        write_once(folder_.trace(chunk_.twin), watch.trace().bytes());
        write_once(folder_.golden(chunk_.twin), to_json(watch.observation()).dump(2) + "\n");
      });
    }
    if (end.how == How::kClean) return;
    if (end.how == How::kLacking) throw RunLacked();
    const std::string what = fmt::format("the run of {} with seed {} and without a fault ended with {}",
                                         options_.scene.string(), options_.seed, end.text);
    if (end.how == How::kEndedFrom || end.how == How::kKilled) throw EnvironmentError(what);
    throw std::logic_error(what);
  }

  /// Runs `job` and ends this process, which is a child.
  template <typename Job>
  [[noreturn]] static void end_child(const Job& job) {
    try {
      job();
    } catch (const EnvironmentError& e) {
      say(e.what());
      _exit(kEnvironment);
    } catch (const std::exception& e) {
      say(e.what());
      _exit(kInternal);
    }
    _exit(kOk);
  }

  /// Settles the runs whose class is known beforehand: the golden twin is unfit for comparison, or never
  /// reaches the phase.
  void settle_without_running(std::vector<const CampaignRun*>& waiting) const {
    const auto unfit = unfit_golden(golden_);
    std::erase_if(waiting, [&](const CampaignRun* run) {
      const PhaseBegin& phase = *run->fault.phase;
      const auto times = std::count(golden_.phases.begin(), golden_.phases.end(), phase.phase);
      if (!unfit && times >= phase.occurrence) return false;
      if (unfit) {
        invalid(*run, *unfit);
      } else {
        CheckedRun checked;
        checked.run_class = RunClass::kNotActivated;
        checked.reason = fmt::format("the phase {} begins {} times without a fault", phase.phase, times);
        write_record(*run, checked, {});
      }
      return true;
    });
  }

  void run_twin(const std::vector<const CampaignRun*>& waiting) {
    const GoldenTrace trace = GoldenTrace::load(folder_.trace(chunk_.twin));
    ForkingWatch watch(trace, waiting, limits_, [&](const CampaignRun& run, const ChildEnd& end) {
      if (std::filesystem::exists(folder_.record(run.number))) return;
      if (end.how == How::kClean) throw std::logic_error("a run ended without a record");
      CheckedRun checked;
      checked.run_class = RunClass::kCrash;
      checked.reason = end.text;
      checked.activated = true;
      write_record(run, checked, {});
    });
    RepetitionOptions options = options_;
    options.watch = &watch;
    try {
      static_cast<void>(run_repetition(options));
    } catch (const AllForked&) {
      return;
    } catch (const EnvironmentError& e) {
      if (watch.run() == nullptr) throw;
      say(e.what());
      _exit(kEnvironment);
    } catch (const std::exception& e) {
      if (watch.run() == nullptr) throw;
      const std::string what = e.what();
      end_child([&] {
        CheckedRun checked;
        checked.run_class = RunClass::kCrash;
        checked.reason = what;
        checked.activated = true;
        write_record(*watch.run(), checked, {});
      });
    }
    if (watch.run() == nullptr) return;  // the twin did not repeat the golden run
    end_child([&] {
      const CampaignRun& run = *watch.run();
      write_record(run, check_run(watch.observation(), golden_, run.fault, bus_of(run.fault.target)),
                   watch.observation());
    });
  }

  void invalid(const CampaignRun& run, const std::string& reason) const {
    CheckedRun checked;
    checked.reason = reason;
    write_record(run, checked, {});
  }

  void write_record(const CampaignRun& run, const CheckedRun& checked,
                    std::optional<RunObservation> observation) const {
    write_once(folder_.fault_plan(run.number), fault_plan_text(run.fault));
    write_once(folder_.record(run.number),
               to_json(record_of(folder_.plan(), run, checked, std::move(observation))).dump(2) + "\n");
  }

  /// Returns the interface of the bus that the device is on, or of the bus of that name.
  [[nodiscard]] std::string bus_of(const std::string& target) const {
    for (const Bus& bus : robot_.devices.buses) {
      if (bus.name == target) return bus.interface;
      for (const Device& device : bus.devices)
        if (device.name == target) return bus.interface;
    }
    return "";
  }

  const CampaignFolder& folder_;
  const CampaignChunk& chunk_;
  RepetitionOptions options_;
  KnownRobot robot_;
  ChildLimits limits_;
  RunObservation golden_;
};

}  // namespace

void run_chunk(const CampaignFolder& folder, const CampaignChunk& chunk) {
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  ChunkRunner(folder, chunk).run();
}

}  // namespace walkman::apps
