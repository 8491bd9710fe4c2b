#include "adaptation/perception/pcd.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {
namespace {

// PCL writes its warnings to the terminal; errors come back as exceptions and codes, which is enough.
class QuietPcl {
 public:
  QuietPcl() : before_(pcl::console::getVerbosityLevel()) {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~QuietPcl() { pcl::console::setVerbosityLevel(before_); }
  QuietPcl(const QuietPcl&) = delete;
  QuietPcl& operator=(const QuietPcl&) = delete;

 private:
  pcl::console::VERBOSITY_LEVEL before_;
};

}  // namespace

camera::OrganizedCloud read_pcd(const std::filesystem::path& file) {
  const PcdHeader header = read_pcd_header(file);
  const QuietPcl quiet;
  pcl::PointCloud<pcl::PointXYZ> points;
  int code = 0;
  try {
    code = pcl::PCDReader().read(file.string(), points);
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": points not readable: " + error.what());
  }
  if (code != 0 || points.size() != header.points)
    throw std::runtime_error(file.string() + ": points not readable: found " + std::to_string(points.size()) +
                             ", expected " + std::to_string(header.points));
  camera::OrganizedCloud cloud;
  cloud.width = static_cast<int>(header.width);
  cloud.height = static_cast<int>(header.height);
  cloud.points.reserve(points.size());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto& p : points)
    cloud.points.push_back(p.getVector3fMap().allFinite() ? Eigen::Vector3f(p.getVector3fMap())
                                                          : Eigen::Vector3f::Constant(nan));
  return cloud;
}

void write_pcd(const std::filesystem::path& file, const camera::OrganizedCloud& cloud) {
  pcl::PointCloud<pcl::PointXYZ> points;
  points.reserve(cloud.points.size());
  for (const auto& p : cloud.points) points.emplace_back(p.x(), p.y(), p.z());
  if (points.empty() ||
      points.size() != static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height))
    throw std::runtime_error(file.string() + ": not written: the cloud has " + std::to_string(points.size()) +
                             " points, expected " + std::to_string(cloud.width) + " times " +
                             std::to_string(cloud.height));
  points.width = static_cast<std::uint32_t>(cloud.width);
  points.height = static_cast<std::uint32_t>(cloud.height);
  points.is_dense = false;
  const QuietPcl quiet;
  try {
    if (pcl::PCDWriter().writeBinary(file.string(), points) == 0) return;
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": not written: " + error.what());
  }
  throw std::runtime_error(file.string() + ": not written");
}

}  // namespace walkman::perception
