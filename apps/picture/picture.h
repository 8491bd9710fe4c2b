#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace walkman::picture {

/// A colour picture, 8 bits a channel, sRGB.
struct Picture {
  int width = 0, height = 0;                        ///< px
  std::vector<std::array<std::uint8_t, 3>> pixels;  ///< red, green, blue; rows from the top, left to right
};

}  // namespace walkman::picture
