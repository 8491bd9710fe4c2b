#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <yaml-cpp/yaml.h>

namespace walkman {

/// Parses a YAML file of at most 1 MB. Throws std::runtime_error with file and line.
[[nodiscard]] YAML::Node parse_yaml_file(const std::filesystem::path& file);

/// One mapping of a YAML file, read strictly: only known keys, each once, each of the requested type. Every
/// error is a std::runtime_error `FILE:LINE: PLACE: what was found, what was expected`.
class YamlMap {
 public:
  /// `place`: where it is in the file (e.g. `objects[0]`; empty at the top); `keys`: those it may have.
  YamlMap(std::string file, const YAML::Node& node, std::string place, std::vector<std::string> keys);

  /// From now on, missing keys are taken from `base`, a mapping of the same kind in another file. Mappings in
  /// both are merged, with the keys of both; so are entries of the same `name` in both lists of a key, where
  /// further entries follow those of `base`. A list without names replaces that of `base`.
  void extend(const YamlMap& base) { base_ = std::make_shared<const YamlMap>(base); }

  [[nodiscard]] bool has(const std::string& key) const { return has_own(key) || (base_ && base_->has(key)); }
  /// Whether the key is present and holds a mapping.
  [[nodiscard]] bool is_mapping(const std::string& key) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  /// A single text or a list of texts.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  [[nodiscard]] bool flag(const std::string& key) const;      ///< true, false, yes or no
  [[nodiscard]] double number(const std::string& key) const;  ///< finite
  /// A number within `least` .. `most`.
  [[nodiscard]] double number(const std::string& key, double least, double most) const;
  [[nodiscard]] long long integer(const std::string& key, long long min, long long max) const;
  /// A hexadecimal number as usual in the field: 0x6041.
  [[nodiscard]] std::uint32_t hexadecimal(const std::string& key, std::uint32_t min, std::uint32_t max) const;
  [[nodiscard]] std::array<double, 2> number_pair(const std::string& key) const;  ///< finite
  [[nodiscard]] std::array<double, 6> six_numbers(const std::string& key) const;  ///< finite
  /// Finite, none of them larger in size than `most`.
  [[nodiscard]] Eigen::Vector3d vector3(const std::string& key,
                                        double most = std::numeric_limits<double>::max()) const;
  /// Largest coordinate of a place, m: a world in which a ray's distances are still exact to a tenth of a
  /// millimetre.
  static constexpr double kFarthest = 1000;
  /// Pose from `xyz_m` and `rpy_rad` (roll, pitch, yaw about fixed axes, in this order).
  [[nodiscard]] Eigen::Isometry3d pose() const;
  /// `key` as a path relative to the YAML file. The file must exist.
  [[nodiscard]] std::filesystem::path existing_file(const std::string& key) const;

  [[nodiscard]] YamlMap map(const std::string& key, std::vector<std::string> keys) const;
  [[nodiscard]] std::vector<YamlMap> list(const std::string& key, const std::vector<std::string>& keys) const;

  /// "FILE:LINE", where the mapping begins.
  [[nodiscard]] std::string where() const;

  /// Throws about the value of `key`, or about the whole mapping if `key` is empty or absent.
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;

 private:
  [[nodiscard]] bool has_own(const std::string& key) const { return static_cast<bool>(node_[key]); }
  /// The mapping in which `key` is written, this one or one that it extends.
  [[nodiscard]] const YamlMap& owner(const std::string& key) const {
    return has_own(key) || !base_ || !base_->has(key) ? *this : base_->owner(key);
  }
  void read_numbers(const std::string& key, double* out, std::size_t count) const;
  [[nodiscard]] YAML::Node at(const std::string& key) const;
  [[nodiscard]] std::string place_of(const std::string& key) const;
  [[noreturn]] void fail_at(const YAML::Node& node, const std::string& place,
                            const std::string& reason) const;

  std::string file_;
  YAML::Node node_;
  std::string place_;
  std::vector<std::string> keys_;
  std::shared_ptr<const YamlMap> base_;  // mapping that this one extends
};

}  // namespace walkman
