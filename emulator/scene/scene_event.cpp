#include "emulator/scene/scene_event.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "emulator/scene/scene.h"
#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

constexpr double kLongest = 1e6;  // s
constexpr double kHardest = 1e5;  // N

/// Returns the element of `all` that the key `key` of `map` names.
template <typename T>
const T& named(const YamlMap& map, const std::string& key, const std::vector<T>& all, const char* kind) {
  const std::string name = map.text(key);
  std::vector<std::string> names;
  for (const T& candidate : all) {
    if (candidate.name == name) return candidate;
    names.push_back(candidate.name);
  }
  map.fail(key, fmt::format("there is no {} \"{}\"{}", kind, name,
                            names.empty() ? "" : did_you_mean(name, names)));
}

PushEvent read_push(const YamlMap& map) {
  PushEvent push;
  push.link = map.text("link");
  push.force_W = map.vector3("force_N");
  if (push.force_W.norm() > kHardest)
    map.fail("force_N", fmt::format("{:.3g} N, expected at most {:g} N", push.force_W.norm(), kHardest));
  if (map.has("point_m")) push.p_LP = map.vector3("point_m");
  push.duration = map.number("duration_s");
  if (!(push.duration > 0 && push.duration <= kLongest))
    map.fail("duration_s",
             fmt::format("{} s, expected more than 0 and at most {:g} s", push.duration, kLongest));
  return push;
}

MoveWeightEvent read_move(const YamlMap& map, const std::vector<SceneObject>& objects) {
  const SceneObject& object = named(map, "object", objects, "object");
  AttachedWeight weight = named(map, "weight", object.weights, "weight");
  read_place(map, object, weight);
  return {object.name, weight.name, weight.link, weight.X_LA};
}

PhaseBegin read_phase(const YamlMap& map) {
  PhaseBegin begin;
  begin.phase = map.text("phase");
  if (map.has("occurrence")) begin.occurrence = static_cast<int>(map.integer("occurrence", 1, 1'000'000));
  if (map.has("after_s")) begin.after = map.number("after_s", 0, kLongest);
  return begin;
}

RemoveWeightEvent read_removal(const YamlMap& map, const std::vector<SceneObject>& objects) {
  const SceneObject& object = named(map, "object", objects, "object");
  return {object.name, named(map, "weight", object.weights, "weight").name};
}

const std::vector<std::string> kChannels = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

int channel_of(const YamlMap& map, const std::string& key, const std::string& name) {
  const auto found = std::find(kChannels.begin(), kChannels.end(), name);
  if (found == kChannels.end())
    map.fail(key, fmt::format("found \"{}\", expected {}", name, fmt::join(kChannels, ", ")));
  return static_cast<int>(found - kChannels.begin());
}

SensorFaultEvent::Bit read_bit(const YamlMap& map) {
  SensorFaultEvent::Bit bit;
  bit.channel = channel_of(map, "channel", map.text("channel"));
  bit.number = static_cast<int>(map.integer("number", 0, 15));
  if (map.has("stuck_at") == map.has("flipped_share"))
    map.fail("", "expected either stuck_at or flipped_share");
  if (map.has("stuck_at")) bit.stuck = map.integer("stuck_at", 0, 1) == 1;
  if (map.has("flipped_share")) bit.share = map.number("flipped_share", 0, 1);
  return bit;
}

SensorFaultEvent read_sensor_fault(const YamlMap& map) {
  SensorFaultEvent fault;
  fault.sensor = map.text("sensor");
  if (map.has("gain")) {
    const auto gain = map.six_numbers("gain");
    for (std::size_t i = 0; i < gain.size(); ++i)
      fault.matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) = gain[i];
  }
  if (map.has("swap")) {
    const std::vector<std::string> names = map.texts("swap");
    if (names.size() != 2) map.fail("swap", "expected two channels");
    fault.matrix.row(channel_of(map, "swap", names[0]))
        .swap(fault.matrix.row(channel_of(map, "swap", names[1])));
  }
  if (map.has("drift_per_s")) {
    const auto drift = map.six_numbers("drift_per_s");
    for (std::size_t i = 0; i < drift.size(); ++i) fault.drift[static_cast<Eigen::Index>(i)] = drift[i];
  }
  if (map.has("bit"))
    fault.bit = read_bit(map.map("bit", {"channel", "number", "stuck_at", "flipped_share"}));
  return fault;
}

const std::vector<std::string> kKinds = {"push", "move_weight", "remove_weight", "sensor_fault"};

SceneEvent read_event(const YamlMap& map, const std::vector<SceneObject>& objects) {
  SceneEvent event;
  event.where = map.where();
  if (map.has("at_s") == map.has("in_phase"))
    map.fail(map.has("at_s") ? "at_s" : "", "expected either at_s or in_phase");
  if (map.has("in_phase")) {
    event.phase = read_phase(map.map("in_phase", {"phase", "occurrence", "after_s"}));
  } else {
    event.at = map.number("at_s");
    if (event.at < 0 || event.at > kLongest)
      map.fail("at_s", fmt::format("{} s, expected 0 to {:g} s", event.at, kLongest));
  }
  const auto given = std::count_if(kKinds.begin(), kKinds.end(), [&](const auto& k) { return map.has(k); });
  if (given != 1)
    map.fail("", fmt::format("{} of {} given, expected one", given == 0 ? "none" : "more than one",
                             fmt::join(kKinds, ", ")));
  if (map.has("push")) {
    event.what = read_push(map.map("push", {"link", "force_N", "point_m", "duration_s"}));
  } else if (map.has("move_weight")) {
    event.what = read_move(
        map.map("move_weight", {"object", "weight", "from_left_end_m", "link", "xyz_m", "rpy_rad"}), objects);
  } else if (map.has("sensor_fault")) {
    event.what = read_sensor_fault(map.map("sensor_fault", {"sensor", "gain", "swap", "drift_per_s", "bit"}));
  } else {
    event.what = read_removal(map.map("remove_weight", {"object", "weight"}), objects);
  }
  return event;
}

}  // namespace

const std::vector<std::string>& event_keys() {
  static const std::vector<std::string> keys = {"at_s",        "in_phase",      "push",
                                                "move_weight", "remove_weight", "sensor_fault"};
  return keys;
}

std::vector<SceneEvent> read_events(const std::vector<YamlMap>& maps,
                                    const std::vector<SceneObject>& objects) {
  std::vector<std::pair<SceneEvent, const YamlMap*>> read;
  read.reserve(maps.size());
  for (const YamlMap& map : maps) read.emplace_back(read_event(map, objects), &map);
  std::stable_sort(read.begin(), read.end(), [](const auto& a, const auto& b) {
    const bool a_last = a.first.phase.has_value(), b_last = b.first.phase.has_value();
    return a_last != b_last ? b_last : a.first.at < b.first.at;
  });
  std::set<std::string> gone;  // weights' names are unique in a scene
  std::vector<SceneEvent> events;
  for (const auto& [event, map] : read) {
    const auto* move = std::get_if<MoveWeightEvent>(&event.what);
    const auto* removal = std::get_if<RemoveWeightEvent>(&event.what);
    const std::string weight = move != nullptr ? move->weight : removal != nullptr ? removal->weight : "";
    if (!event.phase && gone.contains(weight))
      map->fail("", fmt::format("weight \"{}\" is already taken off before {} s", weight, event.at));
    if (removal != nullptr) gone.insert(weight);
    events.push_back(event);
  }
  return events;
}

}  // namespace walkman
