#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "apps/picture/painted_scene.h"
#include "apps/picture/picture_camera.h"

namespace walkman::picture {

/// Red, green and blue of a pixel, encoded as sRGB (IEC 61966-2-1).
using Rgb = std::array<std::uint8_t, 3>;

/// A colour picture, 8 bits per channel, sRGB.
struct Picture {
  int width = 0, height = 0;  ///< px
  std::vector<Rgb> pixels;    ///< rows from the top, left to right
};

/// How a picture is lit.
struct Lighting {
  Eigen::Vector3f p_to_sun{0.3F, -0.5F, 0.8F};  ///< direction towards the sun in W, any length
  float sun_spread = 0.06F;                     ///< tangent of the half angle that its disc subtends
  float shadow_reach = 3;                       ///< m, nothing farther casts a shadow
  float occlusion_reach = 0.6F;                 ///< m, nothing farther blocks light from the sky
  Eigen::Vector3f ground_centre{0, 0, 0};       ///< centre of the fading ground, in W, m
  float ground_from = 1.6F, ground_to = 3;  ///< m from there: where fading begins and where it is complete
};

/// Renders by ray casting: sun with soft shadows, light of the sky with ambient occlusion, a weak light at
/// the camera. Each pixel has `samples` rays, spread over its area, the sun's disc and the sky by one fixed
/// sequence, so there is no noise and the result depends only on the arguments other than `threads`. Throws
/// std::invalid_argument if samples or threads are below 1 or the camera has no pixels.
[[nodiscard]] Picture render(const PaintedScene& scene, const PictureCamera& camera, const Lighting& lighting,
                             int samples, int threads);

}  // namespace walkman::picture
