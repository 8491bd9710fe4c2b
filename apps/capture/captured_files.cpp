#include "apps/capture/captured_files.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "adaptation/perception/pcd.h"
#include "apps/picture/canvas.h"
#include "apps/picture/png_file.h"

namespace walkman::apps {
namespace {

using multisense::Disparity;

constexpr float kMostDepth = 65.535F;  // m, limit of 16 bits of mm

picture::Picture coloured(const Disparity& disparity) {
  picture::Picture picture;
  picture.width = disparity.width;
  picture.height = disparity.height;
  const auto largest =
      static_cast<float>(*std::max_element(disparity.pixels.begin(), disparity.pixels.end()));
  for (const std::uint16_t d : disparity.pixels) {
    picture.pixels.push_back(d == 0 ? picture::Rgb{} : picture::rainbow(static_cast<float>(d) / largest));
  }
  return picture;
}

struct LitPoint {
  Eigen::Vector3f p;
  float intensity;
};

void write_ply(const std::filesystem::path& file, const std::vector<LitPoint>& points) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (const LitPoint& lit : points) {
    pcl::PointXYZI point;
    point.getVector3fMap() = lit.p;
    point.intensity = lit.intensity;
    cloud.push_back(point);
  }
  if (pcl::PLYWriter().write(file.string(), cloud, true, false) != 0)
    throw std::runtime_error(file.string() + ": cannot be written");
}

// View of the assembled sweep: from above and behind the head, which looks along z of its optical frame.
constexpr double kBehind = 0.1, kAbove = 0.5, kDown = 0.6;  // m, m, rad
constexpr float kLowest = -1, kHighest = 2;                 // m below the head, range of the colours

picture::Picture sweep_picture(const std::vector<multisense::Sweep::Point>& points,
                               const Eigen::Vector3d& up_C) {
  // A level frame with z forward and y down at the head, then a camera behind and above it that looks down.
  const Eigen::Vector3d forward = (Eigen::Vector3d::UnitZ() - up_C * up_C.z()).normalized();
  Eigen::Matrix3d R_LC;
  R_LC << forward.cross(up_C).transpose(), -up_C.transpose(), forward.transpose();
  const Eigen::AngleAxisd tip(-kDown, Eigen::Vector3d::UnitX());
  picture::Canvas canvas;
  std::vector<std::pair<double, const multisense::Sweep::Point*>> order;
  const auto seen = [&](const Eigen::Vector3f& p_C) -> Eigen::Vector3d {
    return tip.inverse() * (R_LC * p_C.cast<double>() + Eigen::Vector3d(0, kAbove, kBehind));
  };
  order.reserve(points.size());
  for (const auto& point : points) order.emplace_back(-seen(point.p_F).z(), &point);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [depth, point] : order) {
    const auto below = static_cast<float>(-up_C.dot(point->p_F.cast<double>()));
    const float share = std::clamp((kHighest - below) / (kHighest - kLowest), 0.0F, 1.0F);
    canvas.dot(seen(point->p_F), picture::rainbow(share), 1);
  }
  return canvas.take();
}

}  // namespace

std::vector<std::string> write_captured(const std::filesystem::path& folder, const multisense::Camera& camera,
                                        const camera::OrganizedCloud& cloud) {
  const multisense::Image* const left = camera.image(multisense::source::kLumaRectifiedLeft);
  const multisense::Image* const right = camera.image(multisense::source::kLumaRectifiedRight);
  if (left == nullptr || right == nullptr || left->pixels.size() != cloud.points.size())
    throw std::runtime_error("the camera sent no images with its disparity");
  perception::write_pcd(folder / "cloud.pcd", cloud);
  std::vector<LitPoint> points;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.points[i].allFinite())
      points.push_back({cloud.points[i], static_cast<float>(left->pixels[i]) / 255});
  }
  write_ply(folder / "cloud.ply", points);
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

std::vector<std::string> write_sweep(const std::filesystem::path& folder,
                                     const std::vector<multisense::Sweep::Point>& sweep,
                                     const Eigen::Vector3d& up_C) {
  camera::OrganizedCloud cloud;
  std::vector<LitPoint> points;
  for (const auto& point : sweep) {
    cloud.points.push_back(point.p_F);
    points.push_back({point.p_F, point.intensity});
  }
  cloud.width = static_cast<int>(sweep.size());
  cloud.height = 1;
  perception::write_pcd(folder / "sweep.pcd", cloud);
  write_ply(folder / "sweep.ply", points);
  picture::write_png(sweep_picture(sweep, up_C), folder / "sweep.png");
  return {"sweep.pcd", "sweep.ply", "sweep.png"};
}

}  // namespace walkman::apps
