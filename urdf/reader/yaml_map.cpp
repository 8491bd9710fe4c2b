#include "urdf/reader/yaml_map.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/depthguard.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/text_file.h"
#include "urdf/reader/utf8.h"
#include "urdf/reader/xml_numbers.h"

namespace walkman {
namespace {

constexpr std::size_t kMaxYamlBytes = 1'000'000;

std::string kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return fmt::format("\"{}\"", node.Scalar());
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node.size());
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "nothing";
  }
}

}  // namespace

YAML::Node parse_yaml_file(const std::filesystem::path& file) {
  const std::string text = read_text_file(file, kMaxYamlBytes);
  try {
    return YAML::Load(text);
  } catch (const YAML::DeepRecursion& error) {
    throw std::runtime_error(fmt::format("{}:{}: nested too deep", file.string(), error.mark.line + 1));
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(one_line(
        fmt::format("{}:{}: not well-formed YAML ({})", file.string(), error.mark.line + 1, error.msg)));
  }
}

YamlMap::YamlMap(std::string file, const YAML::Node& node, std::string place, std::vector<std::string> keys)
    : file_(std::move(file)), node_(node), place_(std::move(place)), keys_(std::move(keys)) {
  if (!node_.IsMap())
    fail_at(node_, place_,
            fmt::format("found {}, expected a mapping of {}", kind_of(node_), fmt::join(keys_, ", ")));
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) fail_at(entry.first, place_, "a key is not plain text");
    const std::string& key = entry.first.Scalar();
    if (!seen.insert(key).second) fail_at(entry.first, place_of(key), "the key appears twice");
    bool known = false;
    for (const std::string& k : keys_) known = known || k == key;
    if (known) continue;
    const std::string hint = did_you_mean(key, keys_);
    fail_at(entry.first, place_of(key),
            hint.empty() ? fmt::format("unknown key, expected one of {}", fmt::join(keys_, ", "))
                         : "unknown key" + hint);
  }
}

std::string YamlMap::place_of(const std::string& key) const {
  return place_.empty() ? key : key.empty() ? place_ : place_ + "." + key;
}

std::string YamlMap::where() const { return fmt::format("{}:{}", file_, node_.Mark().line + 1); }

void YamlMap::fail_at(const YAML::Node& node, const std::string& place, const std::string& reason) const {
  // The value found may span several lines, or contain a zero byte, which ends a message.
  throw std::runtime_error(one_line(
      fmt::format("{}:{}: {}{}{}", file_, node.Mark().line + 1, place, place.empty() ? "" : ": ", reason)));
}

void YamlMap::fail(const std::string& key, const std::string& reason) const {
  const YamlMap& owner = key.empty() ? *this : this->owner(key);
  owner.fail_at(!key.empty() && owner.has_own(key) ? owner.node_[key] : owner.node_, owner.place_of(key),
                reason);
}

bool YamlMap::is_mapping(const std::string& key) const { return owner(key).node_[key].IsMap(); }

YAML::Node YamlMap::at(const std::string& key) const {
  if (!has(key)) fail_at(node_, place_, fmt::format("the key \"{}\" is missing", key));
  return owner(key).node_[key];
}

std::string YamlMap::text(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar() || node.Scalar().empty())
    fail(key, fmt::format("found {}, expected text", kind_of(node)));
  return node.Scalar();
}

std::vector<std::string> YamlMap::texts(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsSequence()) return {text(key)};
  std::vector<std::string> all;
  for (const auto& item : node) {
    if (!item.IsScalar() || item.Scalar().empty())
      fail(key, fmt::format("found {} in the list, expected text", kind_of(item)));
    all.push_back(item.Scalar());
  }
  return all;
}

bool YamlMap::flag(const std::string& key) const {
  const std::string value = text(key);
  if (value == "true" || value == "yes") return true;
  if (value != "false" && value != "no")
    fail(key, fmt::format("found \"{}\", expected yes or no, true or false", value));
  return false;
}

double YamlMap::number(const std::string& key, double least, double most) const {
  const double value = number(key);
  if (value < least || value > most)
    fail(key, fmt::format("found {}, expected {} to {}", value, least, most));
  return value;
}

double YamlMap::number(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(key, fmt::format("found {}, expected a number", kind_of(node)));
  std::array<double, 1> value{};
  if (const auto wrong = parse_numbers(node.Scalar(), value)) fail(key, *wrong + ", expected a number");
  return value[0];
}

long long YamlMap::integer(const std::string& key, long long min, long long max) const {
  const YAML::Node node = at(key);
  const std::string text = node.IsScalar() ? node.Scalar() : "";
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size() || value < min || value > max)
    fail(key, fmt::format("found {}, expected a whole number from {} to {}", kind_of(node), min, max));
  return value;
}

std::uint32_t YamlMap::hexadecimal(const std::string& key, std::uint32_t min, std::uint32_t max) const {
  const std::string value_text = text(key);
  std::uint32_t value = 0;
  const bool prefix =
      value_text.size() > 2 && value_text[0] == '0' && (value_text[1] == 'x' || value_text[1] == 'X');
  const char* begin = value_text.data() + (prefix ? 2 : 0);
  const char* const last = value_text.data() + value_text.size();
  const auto [end, error] = std::from_chars(begin, last, value, 16);
  if (!prefix || error != std::errc() || end != last || value < min || value > max)
    fail(key, fmt::format("found \"{}\", expected a hexadecimal number from 0x{:X} to 0x{:X}", value_text,
                          min, max));
  return value;
}

void YamlMap::read_numbers(const std::string& key, double* out, std::size_t count) const {
  const YAML::Node node = at(key);
  if (!node.IsSequence() || node.size() != count)
    fail(key, fmt::format("found {}, expected a list of {} numbers", kind_of(node), count));
  for (std::size_t i = 0; i < count; ++i) {
    if (!node[i].IsScalar())
      fail(key, fmt::format("found {} in the list, expected a number", kind_of(node[i])));
    std::array<double, 1> value{};
    if (const auto wrong = parse_numbers(node[i].Scalar(), value)) fail(key, *wrong + ", expected a number");
    out[i] = value[0];
  }
}

std::array<double, 2> YamlMap::number_pair(const std::string& key) const {
  std::array<double, 2> pair{};
  read_numbers(key, pair.data(), pair.size());
  return pair;
}

std::array<double, 6> YamlMap::six_numbers(const std::string& key) const {
  std::array<double, 6> numbers{};
  read_numbers(key, numbers.data(), numbers.size());
  return numbers;
}

Eigen::Vector3d YamlMap::vector3(const std::string& key, double most) const {
  Eigen::Vector3d result;
  read_numbers(key, result.data(), 3);
  for (const double number : result)
    if (std::abs(number) > most)
      fail(key, fmt::format("found {}, expected at most {} in size", number, most));
  return result;
}

Eigen::Isometry3d YamlMap::pose() const {
  const Eigen::Vector3d rpy = vector3("rpy_rad");
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = vector3("xyz_m", kFarthest);
  X.linear() = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return X;
}

std::filesystem::path YamlMap::existing_file(const std::string& key) const {
  std::filesystem::path path =
      (std::filesystem::path(owner(key).file_).parent_path() / text(key)).lexically_normal();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    fail(key, fmt::format("there is no file {}", path.string()));
  return path;
}

YamlMap YamlMap::map(const std::string& key, std::vector<std::string> keys) const {
  const YAML::Node node = at(key);
  const YamlMap& owner = this->owner(key);
  YamlMap map(owner.file_, node, owner.place_of(key), keys);
  if (&owner == this && base_ && base_->has(key) && base_->is_mapping(key))
    map.extend(base_->map(key, std::move(keys)));
  return map;
}

std::vector<YamlMap> YamlMap::list(const std::string& key, const std::vector<std::string>& keys) const {
  const YAML::Node node = at(key);
  if (!node.IsSequence()) fail(key, fmt::format("found {}, expected a list", kind_of(node)));
  const YamlMap& owner = this->owner(key);
  std::vector<YamlMap> maps;
  for (std::size_t i = 0; i < node.size(); ++i)
    maps.emplace_back(owner.file_, node[i], fmt::format("{}[{}]", owner.place_of(key), i), keys);
  if (&owner != this || !base_ || !base_->has(key)) return maps;
  const auto named = [](const std::vector<YamlMap>& all) {
    return std::all_of(all.begin(), all.end(), [](const YamlMap& map) { return map.has("name"); });
  };
  const std::vector<YamlMap> before = base_->list(key, keys);
  if (!named(before) || !named(maps)) return maps;
  const auto find = [](std::vector<YamlMap>& all, const YamlMap& like) {
    return std::find_if(all.begin(), all.end(),
                        [&](const YamlMap& map) { return map.text("name") == like.text("name"); });
  };
  // No entry is assigned to another: yaml-cpp would give both the same content.
  std::vector<YamlMap> all;
  std::vector<YamlMap> bases = before;
  for (const YamlMap& base : before) {
    const auto changed = find(maps, base);
    all.push_back(changed == maps.end() ? base : *changed);
    if (changed != maps.end()) all.back().extend(base);
  }
  for (const YamlMap& map : maps)
    if (find(bases, map) == bases.end()) all.push_back(map);
  return all;
}

}  // namespace walkman
