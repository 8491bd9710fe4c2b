#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// Something that was shown on the robot's own side. Times are s of the emulated clock, here and below.
struct ShownEvent {
  enum class By { kDriver, kWarning, kMethod };

  By by = By::kDriver;
  double time = 0;
  std::string device;  ///< that it blames, by its joint or frame, or an interface; empty: none
  std::string text;    ///< one sentence
};

/// A limit of the hardware that the plant has passed.
struct PassedLimit {
  std::string what;  ///< "torque of RElbj", N·m: the same for every run
  double time = 0;
  double value = 0, limit = 0;  ///< in the unit that `what` names
};

/// What a run was, by ground truth, buses and what the drivers and the method showed: all that a checker
/// reads.
struct RunObservation {
  RepetitionResult result;
  std::vector<ShownEvent> events;
  std::vector<PassedLimit> limits;
  std::vector<std::string> phases;  ///< as they began
  std::string object;               ///< that the robot worked on
  std::optional<double> differs;    ///< frames or plant were not those of the golden twin any more
  std::optional<double> off;        ///< and the plant was off by what counts: see `TruthWatch`
  double ended = 0;                 ///< the drives were told to stop
  std::optional<double> still;      ///< since when the robot stood still then; none: it did not
  std::string moving;               ///< then: the joint that left its band last, one word
};

[[nodiscard]] std::string_view to_word(ShownEvent::By by);

[[nodiscard]] nlohmann::json to_json(const ShownEvent& event);
[[nodiscard]] ShownEvent event_from_json(const nlohmann::json& json);
[[nodiscard]] nlohmann::json to_json(const RunObservation& observation);
/// What `to_json` made.
[[nodiscard]] RunObservation observation_from_json(const nlohmann::json& json);

/// To a microsecond, a micrometre and so on, as result files have numbers.
[[nodiscard]] double to_micro(double value);
/// The same, or null.
[[nodiscard]] nlohmann::json optional_json(const std::optional<double>& value);
[[nodiscard]] std::optional<double> optional_number(const nlohmann::json& json);

}  // namespace walkman::apps
