#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/experiment/limit_watch.h"
#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// An event shown on the robot's side. Times are s of the emulated clock, here and below.
struct ShownEvent {
  enum class By { kDriver, kWarning, kMethod };

  By by = By::kDriver;
  double time = 0;
  std::string device;  ///< blamed device, by its joint or frame, or blamed interface; empty: none
  std::string text;    ///< one sentence
  std::optional<double> recovered = std::nullopt;  ///< when the drivers had restored what had failed
};

/// Observation of a run by ground truth, bus traffic and what the drivers and the method showed: everything
/// that a checker reads.
struct RunObservation {
  RepetitionResult result;
  std::vector<ShownEvent> events;
  std::vector<PassedLimit> limits;
  std::vector<std::string> phases;  ///< in the order in which they began
  std::string object;               ///< on which the robot worked
  std::optional<double> differs;    ///< when frames or plant first differed from those of the golden twin
  std::optional<double> off;        ///< when the plant was first off by enough to count: see `TruthWatch`
  double ended = 0;                 ///< when the drives were told to stop
  std::optional<double> still;      ///< start of the standstill after that; none: there was none
  std::string moving;               ///< if there was none: the joint that left its band last, one word
};

[[nodiscard]] std::string_view to_word(ShownEvent::By by);

[[nodiscard]] nlohmann::json to_json(const ShownEvent& event);
[[nodiscard]] ShownEvent event_from_json(const nlohmann::json& json);
[[nodiscard]] nlohmann::json to_json(const RunObservation& observation);
/// Reads the output of `to_json`.
[[nodiscard]] RunObservation observation_from_json(const nlohmann::json& json);

/// Rounds to a microsecond, a micrometre and so on, as in the result files.
[[nodiscard]] double to_micro(double value);
/// The same, or null.
[[nodiscard]] nlohmann::json optional_json(const std::optional<double>& value);
[[nodiscard]] std::optional<double> optional_number(const nlohmann::json& json);

}  // namespace walkman::apps
