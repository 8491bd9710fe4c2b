#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include <yaml-cpp/yaml.h>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {
namespace {

std::string place(const std::filesystem::path& file, const YAML::Mark& mark) {
  return mark.is_null() ? file.string() : file.string() + ":" + std::to_string(mark.line + 1);
}

[[noreturn]] void refuse(const std::string& where, const YAML::Node& value, const std::string& expected) {
  const std::string found = value.IsScalar() ? "'" + value.Scalar() + "'" : "no single value";
  throw std::runtime_error(where + ": found " + found + ", expected " + expected);
}

[[noreturn]] void fail(const std::string& where, const char* before, const std::string& key,
                       const char* after) {
  throw std::runtime_error(std::string(where).append(": ").append(before).append(key).append(after));
}

using Setter = std::function<void(const std::string& where, const YAML::Node& value)>;

// A finite number above zero and up to `highest`.
Setter number(double& target, double highest) {
  return [&target, highest](const std::string& where, const YAML::Node& value) {
    double v = 0;
    if (!YAML::convert<double>::decode(value, v) || !std::isfinite(v) || v <= 0 || v > highest)
      refuse(where, value, "a number above 0 and up to " + std::to_string(highest));
    target = v;
  };
}

template <typename Integer>
Setter count(Integer& target, long long lowest, long long highest) {
  return [&target, lowest, highest](const std::string& where, const YAML::Node& value) {
    long long v = 0;
    if (!YAML::convert<long long>::decode(value, v) || v < lowest || v > highest)
      refuse(where, value, "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest));
    target = static_cast<Integer>(v);
  };
}

std::map<std::string, Setter> setters(StageOneParameters& p) {
  constexpr double kLength = 100, kAngle = 1.5707;
  return {{"reach", number(p.reach, kLength)},
          {"plane_distance", number(p.plane_distance, kLength)},
          {"plane_normal_angle", number(p.plane_normal_angle, kAngle)},
          {"plane_iterations", count(p.plane_iterations, 1, 1'000'000)},
          {"plane_min_share", number(p.plane_min_share, 1)},
          {"above_plane", number(p.above_plane, kLength)},
          {"highest_above_plane", number(p.highest_above_plane, kLength)},
          {"cluster_tolerance", number(p.cluster_tolerance, kLength)},
          {"cluster_min_points", count(p.cluster_min_points, 1, 1'000'000'000)},
          {"outlier_voxel", number(p.outlier_voxel, kLength)},
          {"outlier_neighbours", count(p.outlier_neighbours, 1, 1000)},
          {"outlier_deviations", number(p.outlier_deviations, 1000)},
          {"smoothing_radius", number(p.smoothing_radius, kLength)},
          {"smoothing_voxel", number(p.smoothing_voxel, kLength)},
          {"centroid_voxel", number(p.centroid_voxel, kLength)},
          {"handle_samples", count(p.handle_samples, 1, 10'000'000)},
          {"handle_neighbourhood", number(p.handle_neighbourhood, kLength)},
          {"handle_min_radius", number(p.handle_min_radius, kLength)},
          {"handle_max_radius", number(p.handle_max_radius, kLength)},
          {"handle_gap", number(p.handle_gap, kLength)},
          {"handle_min_inliers", count(p.handle_min_inliers, 1, 1'000'000)},
          {"handle_align_angle", number(p.handle_align_angle, kAngle)},
          {"handle_align_distance", number(p.handle_align_distance, kLength)},
          {"handle_align_radius", number(p.handle_align_radius, kLength)},
          {"seed", count(p.seed, 0, std::numeric_limits<long long>::max())},
          {"threads", count(p.threads, 1, 1024)}};
}

YAML::Node load(const std::filesystem::path& file) {
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file.string() + ": cannot be read");
  } catch (const YAML::ParserException& error) {
    throw std::runtime_error(place(file, error.mark) + ": not YAML: " + error.msg);
  }
}

}  // namespace

StageOneParameters load_stage_one_parameters(const std::filesystem::path& yaml_file) {
  YAML::Node root = load(yaml_file);
  if (root.IsMap() && root["stage_one"]) root.reset(root["stage_one"]);
  StageOneParameters parameters;
  if (root.IsNull()) return parameters;
  if (!root.IsMap())
    throw std::runtime_error(yaml_file.string() + ": found no map, expected keys of Stage I");
  const auto known = setters(parameters);
  std::set<std::string> seen;
  for (const auto& entry : root) {
    std::string where = place(yaml_file, entry.first.Mark());
    if (!entry.first.IsScalar()) refuse(where, entry.first, "a key");
    const std::string& key = entry.first.Scalar();
    const auto setter = known.find(key);
    if (setter == known.end()) fail(where, "unknown key '", key, "' for Stage I");
    if (!seen.insert(key).second) fail(where, "key '", key, "' is given twice");
    where.append(": ").append(key);
    setter->second(where, entry.second);
  }
  if (parameters.handle_min_radius >= parameters.handle_max_radius)
    throw std::runtime_error(
        yaml_file.string() + ": handle_min_radius " + std::to_string(parameters.handle_min_radius) +
        " is not below handle_max_radius " + std::to_string(parameters.handle_max_radius));
  return parameters;
}

}  // namespace walkman::perception
