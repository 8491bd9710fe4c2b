#include "emulator/faults/fault_plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman::faults {
namespace {

constexpr double kShortest = 0.001, kLongest = 1e6;  // s
const std::vector<std::string> kDirections = {"both", "from", "to"};

std::vector<std::string> names_of_kinds() {
  std::vector<std::string> names;
  for (const InjectableFault& kind : injectable_faults()) names.emplace_back(kind.name);
  return names;
}

std::string unknown_kind(const std::string& name) {
  return fmt::format("there is no fault \"{}\"{}; `walkman-hil fault list` lists them", name,
                     did_you_mean(name, names_of_kinds()));
}

std::vector<double> standard_values(const InjectableFault& kind) {
  std::vector<double> values;
  for (const Parameter& parameter : kind.parameters) values.push_back(parameter.standard);
  return values;
}

const std::vector<std::string> kBegins = {"at_s", "in_phase", "on_frame", "when"};

void read_begin(const YamlMap& map, Injection& out) {
  const auto given =
      std::count_if(kBegins.begin(), kBegins.end(), [&](const std::string& key) { return map.has(key); });
  if (given != 1) map.fail("", fmt::format("{} of {} given, expected one", given, fmt::join(kBegins, ", ")));
  if (map.has("at_s")) out.at = map.number("at_s", 0, kLongest);
  if (map.has("in_phase")) {
    const YamlMap phase = map.map("in_phase", {"phase", "occurrence", "after_s"});
    out.phase.emplace();
    out.phase->phase = phase.text("phase");
    if (phase.has("occurrence"))
      out.phase->occurrence = static_cast<int>(phase.integer("occurrence", 1, 1'000'000));
    if (phase.has("after_s")) out.phase->after = phase.number("after_s", 0, kLongest);
  }
  if (map.has("on_frame")) {
    const YamlMap frame = map.map("on_frame", {"bus", "id", "nth"});
    out.frame.emplace();
    out.frame->bus = frame.text("bus");
    out.frame->id = static_cast<std::uint32_t>(frame.hexadecimal("id", 0, 0x7FF));
    if (frame.has("nth")) out.frame->nth = static_cast<std::uint64_t>(frame.integer("nth", 1, 1'000'000'000));
  }
  if (!map.has("when")) return;
  const YamlMap when = map.map("when", {"device", "above", "below"});
  if (when.has("above") == when.has("below")) when.fail("", "expected either above or below");
  out.condition.emplace();
  out.condition->device = when.text("device");
  out.condition->above = when.has("above");
  out.condition->value = when.number(out.condition->above ? "above" : "below");
}

double read_parameter(const YamlMap& map, const Parameter& parameter) {
  const std::string key(parameter.name);
  const double value = map.number(key, parameter.least, parameter.most);
  if (parameter.whole && value != std::round(value))
    map.fail(key, fmt::format("found {}, expected a whole number", value));
  return value;
}

Injection read_fault(const YamlMap& map, std::size_t index) {
  Injection out;
  out.where = map.where();
  const std::string kind = map.text("fault");
  out.kind = find_fault(kind);
  if (out.kind == nullptr) map.fail("fault", unknown_kind(kind));
  out.values = standard_values(*out.kind);
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    const Parameter& parameter = out.kind->parameters[i];
    const std::string key(parameter.name);
    if (map.has(key)) out.values[i] = read_parameter(map, parameter);
  }
  out.name = map.has("name") ? map.text("name") : fmt::format("{}-{}", out.kind->name, index + 1);
  if (is_single(out.kind->target)) {
    if (map.has("target"))
      map.fail("target", fmt::format("\"{}\" always applies to the {}, expected no target", kind,
                                     to_word(out.kind->target)));
  } else {
    out.target = map.text("target");
  }
  if (map.has("direction")) {
    const std::string direction = map.text("direction");
    const auto found = std::find(kDirections.begin(), kDirections.end(), direction);
    if (found == kDirections.end() || out.kind->target != Target::kFrames)
      map.fail("direction", fmt::format("found \"{}\", expected {} and a fault of frames", direction,
                                        fmt::join(kDirections, ", ")));
    out.direction = static_cast<Direction>(found - kDirections.begin());
  }
  read_begin(map, out);
  if (map.has("lasts_s")) out.lasts = map.number("lasts_s", kShortest, kLongest);
  if (map.has("every_s")) {
    if (!out.lasts) map.fail("every_s", "expected lasts_s as well");
    out.every = map.number("every_s", *out.lasts, kLongest);
  }
  if (map.has("seed"))
    out.seed = static_cast<std::uint64_t>(map.integer("seed", 0, std::numeric_limits<long long>::max()));
  return out;
}

/// Applies one NAME=VALUE of the command line.
void take_word(const std::string& key, const std::string& text, Injection& out) {
  const auto number = [&](const std::string& name, double least, double most, std::string_view unit,
                          bool whole = false) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool good = error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
    if (!good || value < least || value > most)
      throw std::runtime_error(fmt::format("{}: {} is \"{}\", expected {:g} to {:g}{}{}", out.kind->name,
                                           name, text, least, most, unit.empty() ? "" : " ", unit));
    if (whole && value != std::round(value))
      throw std::runtime_error(
          fmt::format("{}: {} is \"{}\", expected a whole number", out.kind->name, name, text));
    return value;
  };
  if (key == "direction" && out.kind->target == Target::kFrames) {
    const auto direction = std::find(kDirections.begin(), kDirections.end(), text);
    if (direction == kDirections.end())
      throw std::runtime_error(fmt::format("{}: direction is \"{}\", expected {}", out.kind->name, text,
                                           fmt::join(kDirections, ", ")));
    out.direction = static_cast<Direction>(direction - kDirections.begin());
  } else if (key == "for") {
    out.lasts = number(key, kShortest, kLongest, "s");
  } else if (key == "every") {
    out.every = number(key, kShortest, kLongest, "s");
  } else if (key == "seed") {
    out.seed = static_cast<std::uint64_t>(number(key, 0, 9e15, "", true));
  } else {
    const auto& all = out.kind->parameters;
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Parameter& p) { return p.name == key; });
    if (found == all.end())
      throw std::runtime_error(fmt::format("{}: there is no parameter \"{}\"", out.kind->name, key));
    out.values[static_cast<std::size_t>(found - all.begin())] =
        number(key, found->least, found->most, found->unit, found->whole);
  }
}

}  // namespace

std::uint64_t Injection::stream_seed() const noexcept {
  // FNV-1a: std::hash may differ from one library to another, and results must not.
  std::uint64_t hash = 0xCBF29CE484222325U;
  const auto mix = [&hash](std::uint8_t byte) { hash = (hash ^ byte) * 0x100000001B3U; };
  for (const char character : name) mix(static_cast<std::uint8_t>(character));
  for (unsigned shift = 0; shift < 64; shift += 8) mix(static_cast<std::uint8_t>(seed >> shift));
  return hash;
}

double Injection::value(std::string_view parameter) const {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (kind->parameters[i].name == parameter) return values[i];
  throw std::logic_error(fmt::format("fault {} has no parameter {}", kind->name, parameter));
}

std::vector<Injection> load_fault_plan(const std::filesystem::path& file) {
  const YamlMap root(file.string(), parse_yaml_file(file), "", {"faults"});
  std::vector<std::string> of_all = {"fault", "name", "target", "direction", "lasts_s", "every_s", "seed"};
  of_all.insert(of_all.end(), kBegins.begin(), kBegins.end());
  std::vector<std::string> any = of_all;
  for (const InjectableFault& kind : injectable_faults())
    for (const Parameter& parameter : kind.parameters) any.emplace_back(parameter.name);
  const std::vector<YamlMap> entries = root.list("faults", any);
  std::vector<Injection> out;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    Injection one = read_fault(entries[i], i);
    for (const InjectableFault& kind : injectable_faults())
      for (const Parameter& parameter : kind.parameters) {
        const std::string key(parameter.name);
        const auto has = [&](const Parameter& own) { return own.name == parameter.name; };
        if (entries[i].has(key) &&
            std::none_of(one.kind->parameters.begin(), one.kind->parameters.end(), has))
          entries[i].fail(key, fmt::format("{} has no such parameter", one.kind->name));
      }
    for (const Injection& other : out)
      if (other.name == one.name) entries[i].fail("name", fmt::format("\"{}\" is already used", one.name));
    out.push_back(std::move(one));
  }
  return out;
}

std::vector<KnownTarget> known_targets(const RobotModel& robot, const DeviceTable& devices,
                                       const Scene& scene) {
  std::vector<KnownTarget> all;
  for (const Bus& bus : devices.buses) {
    all.push_back({bus.name, Target::kBus});
    for (const Device& device : bus.devices) {
      const bool drive = device.kind == DeviceKind::kJointDrive || device.kind == DeviceKind::kHandDrive;
      const bool force_torque = device.kind == DeviceKind::kForceTorque;
      all.push_back({device.name, drive          ? Target::kDrive
                                  : force_torque ? Target::kForceTorque
                                                 : Target::kDevice});
    }
  }
  for (const SceneObject& object : scene.objects) {
    all.push_back({object.name, Target::kObject});
    for (const AttachedWeight& weight : object.weights) all.push_back({weight.name, Target::kWeight});
  }
  for (const Link& link : robot.links) all.push_back({link.name, Target::kLink});
  return all;
}

namespace {

bool is_device(Target kind) {
  return kind == Target::kDevice || kind == Target::kDrive || kind == Target::kDrives ||
         kind == Target::kForceTorque;
}

/// Whether a target of kind `kind` may have a fault meant for `wanted`.
bool suits(Target wanted, Target kind) {
  if (wanted == Target::kDevice) return is_device(kind);
  if (wanted == Target::kFrames) return is_device(kind) || kind == Target::kBus;
  if (wanted == Target::kDrives) return kind == Target::kDrive || kind == Target::kBus;
  return wanted == kind;
}

}  // namespace

void require_target(const Injection& injection, const std::vector<KnownTarget>& known) {
  const Target wanted = injection.kind->target;
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(fmt::format("{}{}{}: {}", injection.where, injection.where.empty() ? "" : ": ",
                                         injection.kind->name, why));
  };
  const auto is_known = [&](const std::string& name, auto suited) {
    return std::any_of(known.begin(), known.end(),
                       [&](const KnownTarget& one) { return one.name == name && suited(one.kind); });
  };
  if (!injection.kind->by_hand.empty()) refuse(std::string(injection.kind->by_hand));
  if (injection.frame && !is_known(injection.frame->bus, [](Target kind) { return kind == Target::kBus; }))
    refuse(fmt::format("on_frame.bus: there is no bus \"{}\"", injection.frame->bus));
  if (injection.condition && !is_known(injection.condition->device, [](Target kind) {
        return kind == Target::kDrive || kind == Target::kForceTorque;
      }))
    refuse(fmt::format("when.device: there is no drive or force/torque sensor \"{}\"",
                       injection.condition->device));
  if (is_single(wanted)) return;
  std::vector<std::string> names;
  bool is_another = false;
  for (const KnownTarget& one : known) {
    const bool fits = suits(wanted, one.kind);
    if (fits) names.push_back(one.name);
    if (one.name != injection.target) continue;
    if (fits) return;
    is_another = is_another || (is_device(wanted) && is_device(one.kind));
  }
  if (is_another)
    refuse(fmt::format("{} is not a {}", injection.target,
                       wanted == Target::kForceTorque ? "force/torque sensor" : to_word(wanted)));
  refuse(fmt::format("there is no {} \"{}\"{}",
                     wanted == Target::kFrames   ? "bus or device"
                     : wanted == Target::kDrives ? "bus or drive"
                     : is_device(wanted)         ? "device"
                                                 : to_word(wanted),
                     injection.target, did_you_mean(injection.target, names)));
}

void require_of_emulator(const Injection& injection) {
  if (injection.kind->embedded_only.empty()) return;
  throw std::runtime_error(fmt::format("{}{}{}: {}", injection.where, injection.where.empty() ? "" : ": ",
                                       injection.kind->name, injection.kind->embedded_only));
}

Injection parse_fault(const std::vector<std::string>& words) {
  Injection out;
  std::vector<std::string> names;
  for (const std::string& word : words) {
    if (word.find('=') != std::string::npos) continue;
    const InjectableFault* kind = find_fault(word);
    if (kind == nullptr || out.kind != nullptr) {
      names.push_back(word);
    } else {
      out.kind = kind;
    }
  }
  if (out.kind == nullptr)
    throw std::runtime_error(names.empty() ? "expected a fault, its target and parameters as NAME=VALUE"
                                           : unknown_kind(names.back()));
  const bool wants_target = !is_single(out.kind->target);
  if (names.size() != (wants_target ? 1U : 0U))
    throw std::runtime_error(fmt::format(
        "{}: {} given, expected {}", out.kind->name,
        names.empty() ? "no target" : fmt::format("\"{}\"", names.back()),
        wants_target ? "one target"
                     : fmt::format("no target: it always applies to the {}", to_word(out.kind->target))));
  if (wants_target) out.target = names.front();
  out.name =
      out.target.empty() ? std::string(out.kind->name) : fmt::format("{}-{}", out.target, out.kind->name);
  out.values = standard_values(*out.kind);
  for (const std::string& word : words)
    if (const std::size_t equals = word.find('='); equals != std::string::npos)
      take_word(word.substr(0, equals), word.substr(equals + 1), out);
  if (out.every && (!out.lasts || *out.every < *out.lasts))
    throw std::runtime_error(fmt::format("{}: every={:g}, expected for=S as well, with S no longer than that",
                                         out.kind->name, *out.every));
  return out;
}

std::string log_note(const std::vector<InjectionState>& injections, bool live) {
  std::vector<std::string> names;
  names.reserve(injections.size() + 1);
  for (const InjectionState& state : injections)
    names.push_back(fmt::format("{}{}{}", state.injection.kind->name,
                                state.injection.target.empty() ? "" : " of ", state.injection.target));
  if (live) names.emplace_back("any sent through the fault socket");
  return names.empty() ? "" : fmt::format("INJECTED FAULTS: {}", fmt::join(names, ", "));
}

}  // namespace walkman::faults
