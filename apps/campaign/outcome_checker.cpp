#include "apps/campaign/outcome_checker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "adaptation/regrasp/session.h"

namespace walkman::apps {
namespace {

constexpr double kMoreTorque = 0.1;  // N·m at the wrist, the tolerance of the judge of a weighing
constexpr double kSlower = 1.1;      // times the golden twin's time

constexpr std::array<std::string_view, kRunClasses> kWords = {
    "invalid",   "crash/hang", "damage",    "silent-wrong", "detected-late",
    "safe-stop", "degraded",   "recovered", "masked",       "not-activated"};

bool says_done(Outcome outcome) { return outcome != Outcome::kStopped && outcome != Outcome::kRegraspLimit; }

double final_torque(const RepetitionResult& result) {
  return std::abs(result.after_change ? result.after_change->truth.tau_after : result.truth.tau_after);
}

std::optional<ShownEvent> first_new_event(const RunObservation& run, const RunObservation& golden,
                                          double begun) {
  std::optional<ShownEvent> first;
  for (const ShownEvent& event : run.events) {
    const bool of_golden = std::any_of(golden.events.begin(), golden.events.end(),
                                       [&](const ShownEvent& other) { return other.text == event.text; });
    if (of_golden || event.time < begun) continue;
    if (!first || event.time < first->time) first = event;
  }
  return first;
}

const PassedLimit* new_limit(const RunObservation& run, const RunObservation& golden) {
  for (const PassedLimit& passed : run.limits)
    if (std::none_of(golden.limits.begin(), golden.limits.end(),
                     [&](const PassedLimit& other) { return other.what == passed.what; }))
      return &passed;
  return nullptr;
}

/// The drivers' event that ended a run, the last one; null if the method ended it, or nothing did.
const ShownEvent* cause_of_stop(const RunObservation& run) {
  if (run.result.outcome != Outcome::kStopped) return nullptr;
  const auto last = std::find_if(run.events.rbegin(), run.events.rend(), [&](const ShownEvent& event) {
    return event.by == ShownEvent::By::kDriver && !event.recovered && event.time <= run.ended;
  });
  return last == run.events.rend() ? nullptr : &*last;
}

/// Returns why a task was done worse than by the golden twin; empty if it was not.
std::string worse(const RunObservation& run, const RunObservation& golden) {
  const RepetitionResult &had = run.result, &should = golden.result;
  if (had.outcome == Outcome::kRegraspLimit) return "the method ended at its limit of regrasps";
  if (had.regrasps > should.regrasps)
    return fmt::format("{} regrasps, the golden twin {}", had.regrasps, should.regrasps);
  if (final_torque(had) > final_torque(should) + kMoreTorque)
    return fmt::format("{:.3f} N·m are left at the wrist, with the golden twin {:.3f} N·m", final_torque(had),
                       final_torque(should));
  if (had.simulated_seconds > kSlower * should.simulated_seconds)
    return fmt::format("it took {:.1f} s, the golden twin {:.1f} s", had.simulated_seconds,
                       should.simulated_seconds);
  return "";
}

/// Returns why the method's claim is wrong; nullopt if it is right.
std::optional<std::string> contradicted(const RunObservation& run, const RunObservation& golden) {
  const RepetitionResult& result = run.result;
  if (!says_done(result.outcome)) return std::nullopt;
  if (run.object != golden.object)
    return fmt::format("it worked on {} instead of {}", run.object, golden.object);
  if (result.outcome == Outcome::kDropped) return "the object does not hang free of everything but the hand";
  if (result.outcome == Outcome::kWrong || result.outcome == Outcome::kCollided) return result.reason;
  return std::nullopt;
}

void classify(const RunObservation& run, const RunObservation& golden, const faults::Injection& fault,
              CheckedRun& out) {
  const auto is = [&](RunClass run_class, const std::string& reason) {
    out.run_class = run_class;
    out.reason = reason;
  };
  if (const auto why = unfit_golden(golden)) return is(RunClass::kInvalid, *why);
  if (!out.begun) return is(RunClass::kNotActivated, "the fault did not begin");
  if (const PassedLimit* passed = new_limit(run, golden))
    return is(RunClass::kDamage, fmt::format("{}: {:.4g} at {:.3f} s, limit {:.4g}", passed->what,
                                             passed->value, passed->time, passed->limit));
  if (const auto why = contradicted(run, golden)) return is(RunClass::kSilentWrong, *why);
  const std::string shown = out.shown ? out.shown->text : "";
  const auto interval = fault.kind->interval;
  if (out.shown && interval && run.off && out.shown->time > *run.off + *interval)
    return is(RunClass::kDetectedLate,
              fmt::format("shown {:.3f} s after the plant was off, limit {:.3f} s: {}",
                          out.shown->time - *run.off, *interval, shown));
  for (const ShownEvent& event : run.events) {
    const double within = regrasp::reacted_within(regrasp::Reaction::kRecover);
    const double until = event.recovered.value_or(run.ended);
    const bool answered = event.recovered || run.result.outcome == Outcome::kStopped;
    if (event.by != ShownEvent::By::kDriver || !answered || until <= event.time + within) continue;
    return is(RunClass::kDetectedLate,
              fmt::format("{} after {:.3f} s, limit {:.3f} s: {}", event.recovered ? "recovered" : "stopped",
                          until - event.time, within, event.text));
  }
  if (run.result.outcome == Outcome::kStopped) {
    const double within = regrasp::reacted_within(regrasp::Reaction::kStop);
    if (!run.still || *run.still > run.ended + within)
      return is(RunClass::kDetectedLate,
                fmt::format("no standstill within {:.2f} s of the stop{}{}: {}", within,
                            run.moving.empty() ? "" : ", of ", run.moving, shown));
    return is(RunClass::kSafeStop, shown);
  }
  if (const std::string how = worse(run, golden); !how.empty())
    return is(RunClass::kDegraded, out.shown ? how + "; shown: " + shown : how + "; nothing was shown");
  if (out.shown) return is(RunClass::kRecovered, shown);
  if (out.activated) return is(RunClass::kMasked, "nothing was shown");
  is(RunClass::kNotActivated, "neither frames nor plant differed from the golden twin's");
}

}  // namespace

std::string_view to_word(RunClass run_class) { return kWords[static_cast<std::size_t>(run_class)]; }

RunClass run_class_of(std::string_view word) {
  const auto found = std::find(kWords.begin(), kWords.end(), word);
  if (found == kWords.end()) throw std::runtime_error(fmt::format("\"{}\" is not a class of runs", word));
  return static_cast<RunClass>(found - kWords.begin());
}

std::optional<std::string> unfit_golden(const RunObservation& golden) {
  const Outcome outcome = golden.result.outcome;
  if (outcome == Outcome::kMinimumTorque || outcome == Outcome::kMinimumDisplacement) return std::nullopt;
  return fmt::format("the golden twin does not do its task: {}{}{}", to_string(outcome),
                     golden.result.reason.empty() ? "" : ": ", golden.result.reason);
}

CheckedRun check_run(const RunObservation& run, const RunObservation& golden, const faults::Injection& fault,
                     std::string_view bus) {
  CheckedRun out;
  for (const RepetitionResult::Injected& injected : run.result.faults)
    if (injected.name == fault.name && injected.times > 0) out.begun = injected.first;
  if (out.begun) out.shown = first_new_event(run, golden, *out.begun);
  out.activated = out.begun && (run.differs || out.shown);
  if (out.shown) {
    out.detection = out.shown->time - *out.begun;
    out.blames_target =
        !out.shown->device.empty() && (out.shown->device == fault.target || out.shown->device == bus);
  }
  if (const ShownEvent* cause = cause_of_stop(run); cause != nullptr) {
    out.stopped_by_driver = true;
    if (run.still) out.reaction = std::max(0.0, *run.still - cause->time);
  }
  classify(run, golden, fault, out);
  return out;
}

}  // namespace walkman::apps
