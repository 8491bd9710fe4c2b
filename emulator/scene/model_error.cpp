#include "emulator/scene/model_error.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace walkman {
namespace {

constexpr const char* kNone = "none";

std::vector<std::string> keys_and(std::vector<std::string> others) {
  for (const ErrorKindName& kind : kErrorKinds) others.emplace_back(kind.key);
  return others;
}

std::string level_of(const YamlMap& map, const std::string& key) {
  std::string level = map.text(key);
  const std::vector<std::string>& known = model_error_levels();
  if (std::find(known.begin(), known.end(), level) == known.end())
    map.fail(key, fmt::format("found \"{}\", expected {}", level, fmt::join(known, ", ")));
  return level;
}

std::array<double, 2> read_outliers(const YamlMap& map, const ErrorKindName& kind) {
  const std::array<double, 2> range = map.number_pair("outliers");
  if (range[0] < 0 || range[1] < range[0] || range[1] > 5 * kind.most)
    map.fail("outliers", fmt::format("found {} to {}, expected two rising numbers of 0 to {}", range[0],
                                     range[1], 5 * kind.most));
  return range;
}

/// Reads sigma and, if given, outliers of one quantity.
ModelErrorChoice::Override read_spread(const YamlMap& map, const ErrorKindName& kind) {
  ModelErrorChoice::Override spread{map.number("sigma", 0, kind.most), {}};
  if (map.has("outliers")) spread.outliers = read_outliers(map, kind);
  return spread;
}

std::vector<WeighedPart> read_parts(const YamlMap& top) {
  std::vector<WeighedPart> parts;
  for (const YamlMap& map : top.list("weighed_parts", {"below", "carried_by", "mass_kg"})) {
    constexpr double kLightest = 1e-3, kHeaviest = 1e3;  // kg
    parts.push_back({map.text("below"), map.text("carried_by"), map.number("mass_kg", kLightest, kHeaviest)});
  }
  return parts;
}

}  // namespace

const std::vector<std::string>& model_error_levels() {
  static const std::vector<std::string> levels = {kNone, "calibrated", "uncalibrated"};
  return levels;
}

std::string ModelErrorChoice::text() const {
  std::vector<std::string> changes;
  for (const auto& [kind, spread] : changed)
    changes.push_back(fmt::format("{} {:g}", name_of(kind).key, spread.sigma));
  if (weighed_parts) changes.push_back(*weighed_parts ? "weighed parts" : "no weighed parts");
  return changes.empty() ? level : fmt::format("{}, but {}", level, fmt::join(changes, ", "));
}

ModelErrorChoice read_model_error(const YamlMap& scene) {
  constexpr const char* kKey = "model_error";
  ModelErrorChoice choice;
  if (!scene.is_mapping(kKey)) {
    choice.level = level_of(scene, kKey);
    return choice;
  }
  const YamlMap map = scene.map(kKey, keys_and({"base", "weighed_parts"}));
  choice.level = level_of(map, "base");
  if (map.has("weighed_parts")) choice.weighed_parts = map.flag("weighed_parts");
  for (std::size_t i = 0; i < kErrorKinds.size(); ++i) {
    const ErrorKindName& kind = kErrorKinds[i];
    if (!map.has(kind.key)) continue;
    choice.changed[static_cast<ErrorKind>(i)] =
        map.is_mapping(kind.key) ? read_spread(map.map(kind.key, {"sigma", "outliers"}), kind)
                                 : ModelErrorChoice::Override{map.number(kind.key, 0, kind.most), {}};
  }
  return choice;
}

bool ModelError::any() const {
  return !weighed_parts.empty() ||
         std::any_of(spreads.begin(), spreads.end(), [](const Spread& spread) { return spread.any(); });
}

ModelError load_model_error(const std::filesystem::path& file, const ModelErrorChoice& choice) {
  const YamlMap top(file.string(), parse_yaml_file(file), "",
                    {"outlier_share", "spreads", "weighed_parts", "levels_with_weighed_parts"});
  ModelError error;
  error.outlier_share = top.number("outlier_share", 0, 0.5);
  const std::vector<std::string>& levels = model_error_levels();
  const YamlMap spreads = top.map("spreads", keys_and({}));
  for (std::size_t i = 0; i < kErrorKinds.size(); ++i) {
    const ErrorKindName& kind = kErrorKinds[i];
    Spread& spread = error.spreads[i];
    const YamlMap by_level = spreads.map(kind.key, {levels.begin() + 1, levels.end()});
    for (std::size_t level = 1; level < levels.size(); ++level) {  // all are read, whichever is chosen
      const auto read = read_spread(by_level.map(levels[level], {"sigma", "outliers"}), kind);
      if (levels[level] != choice.level) continue;
      spread.sigma = read.sigma;
      if (read.outliers)
        std::tie(spread.least, spread.most) = std::tuple((*read.outliers)[0], (*read.outliers)[1]);
    }
    const auto changed = choice.changed.find(static_cast<ErrorKind>(i));
    if (changed == choice.changed.end()) continue;
    const double scale = spread.sigma > 0 ? changed->second.sigma / spread.sigma : 0;
    spread = {changed->second.sigma, scale * spread.least, scale * spread.most};
    if (const auto& outliers = changed->second.outliers) {
      spread.least = (*outliers)[0];
      spread.most = (*outliers)[1];
    }
  }
  std::vector<WeighedPart> parts = read_parts(top);
  const std::vector<std::string> weighed = top.texts("levels_with_weighed_parts");
  for (const std::string& level : weighed) {
    if (std::find(levels.begin(), levels.end(), level) == levels.end())
      top.fail("levels_with_weighed_parts",
               fmt::format("found \"{}\", expected {}", level, fmt::join(levels, ", ")));
  }
  if (choice.weighed_parts.value_or(std::find(weighed.begin(), weighed.end(), choice.level) != weighed.end()))
    error.weighed_parts = std::move(parts);
  return error;
}

}  // namespace walkman
