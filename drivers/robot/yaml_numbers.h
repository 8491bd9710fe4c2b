#pragma once

#include <cstdint>
#include <string>

#include "urdf/reader/yaml_map.h"

namespace walkman::robot {

/// The value of `key`, written in hexadecimal as the field does: 0x6041. Throws std::runtime_error with file
/// and line when it is something else or not within `min` .. `max`.
[[nodiscard]] std::uint32_t read_hexadecimal(const YamlMap& map, const std::string& key, std::uint32_t min,
                                             std::uint32_t max);

}  // namespace walkman::robot
