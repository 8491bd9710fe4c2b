#include "apps/capture/captured_files.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "adaptation/perception/pcd.h"
#include "apps/picture/png_file.h"

namespace walkman::apps {
namespace {

using multisense::Disparity;

constexpr float kMostDepth = 65.535F;  // m, in 16 bits of mm

/// From blue over green to red.
std::array<std::uint8_t, 3> colour_of(float share) {
  const auto part = [share](float centre) {
    const float value = std::clamp(1.5F - std::abs(4 * share - centre), 0.0F, 1.0F);
    return static_cast<std::uint8_t>(std::lround(255 * value));
  };
  return {part(3), part(2), part(1)};
}

picture::Picture coloured(const Disparity& disparity) {
  picture::Picture picture;
  picture.width = disparity.width;
  picture.height = disparity.height;
  const auto largest =
      static_cast<float>(*std::max_element(disparity.pixels.begin(), disparity.pixels.end()));
  for (const std::uint16_t d : disparity.pixels) {
    picture.pixels.push_back(d == 0 ? std::array<std::uint8_t, 3>{}
                                    : colour_of(static_cast<float>(d) / largest));
  }
  return picture;
}

void write_ply(const std::filesystem::path& file, const camera::OrganizedCloud& cloud,
               const multisense::Image& image) {
  pcl::PointCloud<pcl::PointXYZI> points;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    if (!p.allFinite()) continue;
    pcl::PointXYZI point;
    point.getVector3fMap() = p;
    point.intensity = static_cast<float>(image.pixels[i]) / 255;
    points.push_back(point);
  }
  if (pcl::PLYWriter().write(file.string(), points, true, false) != 0)
    throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

std::vector<std::string> write_captured(const std::filesystem::path& folder, const multisense::Camera& camera,
                                        const camera::OrganizedCloud& cloud) {
  const multisense::Image* const left = camera.image(multisense::source::kLumaRectifiedLeft);
  const multisense::Image* const right = camera.image(multisense::source::kLumaRectifiedRight);
  if (left == nullptr || right == nullptr || left->pixels.size() != cloud.points.size())
    throw std::runtime_error("the camera sent no images with its disparity");
  perception::write_pcd(folder / "cloud.pcd", cloud);
  write_ply(folder / "cloud.ply", cloud, *left);
  picture::write_grey_png(left->width, left->height, left->pixels, folder / "left.png");
  picture::write_grey_png(right->width, right->height, right->pixels, folder / "right.png");
  picture::write_png(coloured(camera.disparity()), folder / "disparity.png");
  std::vector<std::uint16_t> depth;
  for (const Eigen::Vector3f& p : cloud.points) {
    const bool seen = p.z() > 0 && p.z() < kMostDepth;
    depth.push_back(seen ? static_cast<std::uint16_t>(std::lround(1e3F * p.z())) : std::uint16_t{0});
  }
  picture::write_grey_png(cloud.width, cloud.height, depth, folder / "depth.png");
  return {"cloud.pcd", "cloud.ply", "left.png", "right.png", "disparity.png", "depth.png"};
}

}  // namespace walkman::apps
