#include "adaptation/parameters.h"

#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

/// A parameter's key, its member, and its valid range.
template <typename Stage>
struct Number {
  const char* key;
  double Stage::*member;
  double least, most;
};

/// The same for an integer.
template <typename Stage>
struct Count {
  const char* key;
  std::variant<int Stage::*, std::uint64_t Stage::*> member;
  long long least, most;
};

// As `least`: zero itself is rejected, too.
constexpr double kAboveZero = std::numeric_limits<double>::min();

/// The parameters of one section; those without a key in the file keep their defaults.
template <typename Stage>
class Section {
 public:
  Section(std::vector<Number<Stage>> numbers, std::vector<Count<Stage>> counts)
      : numbers_(std::move(numbers)), counts_(std::move(counts)) {}

  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const auto& number : numbers_) keys.emplace_back(number.key);
    for (const auto& count : counts_) keys.emplace_back(count.key);
    return keys;
  }

  [[nodiscard]] Stage read(const YamlMap& map) const {
    Stage stage;
    for (const auto& number : numbers_) {
      if (!map.has(number.key)) continue;
      const double value = map.number(number.key);
      if (number.least == kAboveZero && (value <= 0 || value > number.most))
        map.fail(number.key,
                 fmt::format("found {}, expected more than 0 and at most {}", value, number.most));
      stage.*number.member = map.number(number.key, number.least, number.most);
    }
    for (const auto& count : counts_) {
      if (!map.has(count.key)) continue;
      const long long value = map.integer(count.key, count.least, count.most);
      std::visit(
          [&](auto member) {
            stage.*member = static_cast<std::remove_reference_t<decltype(stage.*member)>>(value);
          },
          count.member);
    }
    return stage;
  }

 private:
  std::vector<Number<Stage>> numbers_;
  std::vector<Count<Stage>> counts_;
};

Section<StageOneParameters> stage_one_section() {
  using P = StageOneParameters;
  constexpr double kLength = 100, kAngle = 1.5707, kDeviations = 1000;
  return {{{"reach", &P::reach, kAboveZero, kLength},
           {"plane_distance", &P::plane_distance, kAboveZero, kLength},
           {"plane_deviations", &P::plane_deviations, 0, kDeviations},
           {"plane_normal_angle", &P::plane_normal_angle, kAboveZero, kAngle},
           {"plane_min_share", &P::plane_min_share, kAboveZero, 1},
           {"above_plane", &P::above_plane, kAboveZero, kLength},
           {"above_plane_deviations", &P::above_plane_deviations, 0, kDeviations},
           {"highest_above_plane", &P::highest_above_plane, kAboveZero, kLength},
           {"cluster_tolerance", &P::cluster_tolerance, kAboveZero, kLength},
           {"cluster_min_area", &P::cluster_min_area, kAboveZero, kLength},
           {"asked_distance", &P::asked_distance, kAboveZero, kLength},
           {"outlier_voxel", &P::outlier_voxel, kAboveZero, kLength},
           {"outlier_deviations", &P::outlier_deviations, kAboveZero, kDeviations},
           {"smoothing_radius", &P::smoothing_radius, 0, kLength},
           {"smoothing_voxel", &P::smoothing_voxel, kAboveZero, kLength},
           {"centroid_voxel", &P::centroid_voxel, kAboveZero, kLength},
           {"handle_neighbourhood", &P::handle_neighbourhood, kAboveZero, kLength},
           {"handle_min_radius", &P::handle_min_radius, kAboveZero, kLength},
           {"handle_max_radius", &P::handle_max_radius, kAboveZero, kLength},
           {"handle_gap", &P::handle_gap, kAboveZero, kLength},
           {"handle_align_angle", &P::handle_align_angle, kAboveZero, kAngle},
           {"handle_align_distance", &P::handle_align_distance, kAboveZero, kLength},
           {"handle_align_radius", &P::handle_align_radius, kAboveZero, kLength}},
          {{"plane_iterations", &P::plane_iterations, 1, 1'000'000},
           {"outlier_neighbours", &P::outlier_neighbours, 0, 1000},
           {"handle_samples", &P::handle_samples, 1, 10'000'000},
           {"handle_min_inliers", &P::handle_min_inliers, 1, 1'000'000},
           {"seed", &P::seed, 0, std::numeric_limits<long long>::max()},
           {"threads", &P::threads, 1, 1024}}};
}

Section<StageTwoParameters> stage_two_section() {
  using P = StageTwoParameters;
  constexpr double kLength = 1.0;  // m
  constexpr double kTime = 60.0;   // s
  constexpr double kShort = 0.02;  // s, four cycles
  constexpr double kSlow = 0.001;  // m/s or rad/s
  return {{{"torque_threshold", &P::torque_threshold, 0, 100},
           {"displacement_threshold", &P::displacement_threshold, 0, kLength},
           {"average_time", &P::average_time, kShort, kTime},
           {"tare_time", &P::tare_time, kShort, kTime},
           {"pose_time", &P::pose_time, kShort, kTime},
           {"rest_speed", &P::rest_speed, kSlow, 1},
           {"rest_time", &P::rest_time, kShort, kTime},
           {"rest_timeout", &P::rest_timeout, kShort, kTime},
           {"sensor_gain", &P::sensor_gain, 1e-6, 0.5},
           {"sensor_axial_gain", &P::sensor_axial_gain, 1e-6, 0.5},
           {"sensor_cross_talk", &P::sensor_cross_talk, 1e-6, 0.5},
           {"sensor_force_per_torque", &P::sensor_force_per_torque, 1e-6, 100},
           {"sensor_torque_per_force", &P::sensor_torque_per_force, 1e-9, 0.1},
           {"sensor_force_range", &P::sensor_force_range, 1, 1e6},
           {"sensor_torque_range", &P::sensor_torque_range, 0.01, 1e6},
           {"calibration_turn", &P::calibration_turn, 0, 1.5},
           {"weighing_turn", &P::weighing_turn, 0.02, 0.5},
           {"approach_height", &P::approach_height, 0, kLength},
           {"approach_back", &P::approach_back, 0, kLength},
           {"palm_clearance", &P::palm_clearance, 0, kLength},
           {"lift_height", &P::lift_height, 0, kLength},
           {"lift_step", &P::lift_step, 0.001, kLength},
           {"lift_max", &P::lift_max, 0, kLength},
           {"lift_force_change", &P::lift_force_change, 0, 1000},
           {"payload_time", &P::payload_time, kShort, kTime},
           {"lift_window", &P::lift_window, kShort, kTime},
           {"min_force", &P::min_force, 0, 1000},
           {"watch_time", &P::watch_time, 0, kTime},
           {"force_slope", &P::force_slope, 0, 1000},
           {"torque_slope", &P::torque_slope, 0, 1000},
           {"force_drift", &P::force_drift, 0, 1000},
           {"torque_drift", &P::torque_drift, 0, 1000},
           {"close_time", &P::close_time, kShort, kTime},
           {"hold_time", &P::hold_time, 0, kTime},
           {"grip_torque", &P::grip_torque, 0, 1},
           {"touch_force", &P::touch_force, 0, 1000},
           {"empty_closure", &P::empty_closure, 0, 1},
           {"travel_speed", &P::travel_speed, kSlow, 1},
           {"approach_speed", &P::approach_speed, kSlow, 1},
           {"lift_speed", &P::lift_speed, kSlow, 1},
           {"hanging_turn", &P::hanging_turn, 0, 1},
           {"hanging_roll", &P::hanging_roll, 0, 1},
           {"carry_time", &P::carry_time, 0, 60},
           {"angular_speed", &P::angular_speed, kSlow, 5}},
          {{"max_regrasps", &P::max_regrasps, 0, std::numeric_limits<int>::max()},
           {"max_looks", &P::max_looks, 1, 100}}};
}

}  // namespace

MethodParameters load_method_parameters(const std::filesystem::path& file) {
  const YAML::Node root = parse_yaml_file(file);
  MethodParameters parameters;
  if (root.IsNull()) return parameters;
  const YamlMap map(file.string(), root, "", {"stage_one", "stage_two"});
  if (map.has("stage_one") && !root["stage_one"].IsNull()) {
    const Section section = stage_one_section();
    std::vector<std::string> keys = section.keys();
    keys.emplace_back("look");
    const YamlMap stage = map.map("stage_one", keys);
    parameters.stage_one = section.read(stage);
    if (stage.has("look")) {
      const std::string look = stage.text("look");
      if (look != "once" && look != "around")
        stage.fail("look", fmt::format("found {}, expected once or around", look));
      parameters.stage_one.look = look == "around" ? Look::kAround : Look::kOnce;
    }
    const StageOneParameters& read = parameters.stage_one;
    if (read.handle_min_radius >= read.handle_max_radius)
      stage.fail("handle_min_radius",
                 fmt::format("found {}, expected less than handle_max_radius, which is {}",
                             read.handle_min_radius, read.handle_max_radius));
  }
  if (map.has("stage_two") && !root["stage_two"].IsNull()) {
    const Section section = stage_two_section();
    parameters.stage_two = section.read(map.map("stage_two", section.keys()));
  }
  return parameters;
}

}  // namespace walkman
