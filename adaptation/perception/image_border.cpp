#include "adaptation/perception/image_border.h"

#include <algorithm>
#include <cmath>

#include "adaptation/perception/sampling.h"

namespace walkman::perception {
namespace {

constexpr int kMargin = 2;              // px, from the outermost point
constexpr double kWidestMargin = 0.05;  // share of the image
constexpr std::size_t kFewestAtBorder = 4;
constexpr std::size_t kFewestRows = 20;  // with a strip, to determine its width from
constexpr double kStripScatter = 0.1;    // share of its width times depth

}  // namespace

ImageBorder::ImageBorder(const camera::OrganizedCloud& cloud)
    : cloud_(cloud), organized_(is_organized(cloud)) {
  if (!organized_) return;
  left_ = cloud.width;
  top_ = cloud.height;
  first_column_.assign(static_cast<std::size_t>(cloud.height), cloud.width);
  std::vector<double> strips;
  for (int row = 0; row < cloud.height; ++row) {
    const auto valid = [&](int column) { return std::isfinite(cloud.at(column, row).x()); };
    int first = 0, last = cloud.width - 1;
    while (first < cloud.width && !valid(first)) ++first;
    if (first == cloud.width) continue;
    while (!valid(last)) --last;
    first_column_[static_cast<std::size_t>(row)] = first;
    left_ = std::min(left_, first);
    right_ = std::max(right_, last);
    top_ = std::min(top_, row);
    bottom_ = row;
    const Eigen::Vector3f &from = cloud.at(first, row), &to = cloud.at(last, row);
    const double across = double{to.x()} / to.z() - double{from.x()} / from.z();
    if (last > first && across > 0) focal_ = std::max(focal_, (last - first) / across);
    if (first > kMargin) strips.push_back(first * static_cast<double>(cloud.at(first, row).z()));
  }
  // A wider margin is not a border; the scene is simply empty there.
  if (left_ > kWidestMargin * cloud.width) left_ = -kMargin - 1;
  if (cloud.width - 1 - right_ > kWidestMargin * cloud.width) right_ = cloud.width + kMargin;
  if (top_ > kWidestMargin * cloud.height) top_ = -kMargin - 1;
  if (cloud.height - 1 - bottom_ > kWidestMargin * cloud.height) bottom_ = cloud.height + kMargin;

  if (strips.size() < kFewestRows) return;
  const auto middle = strips.begin() + static_cast<std::ptrdiff_t>(strips.size() / 2);
  std::nth_element(strips.begin(), middle, strips.end());
  const double strip = *middle;
  const auto near = std::count_if(strips.begin(), strips.end(),
                                  [strip](double s) { return std::abs(s - strip) < kStripScatter * strip; });
  // Unless the product is the same at every depth, the left is blank for another reason.
  if (strip > 0 && 2 * static_cast<std::size_t>(near) > strips.size()) strip_ = strip;
}

bool ImageBorder::at_border(std::uint32_t point) const {
  const int row = static_cast<int>(point) / cloud_.width, column = static_cast<int>(point) % cloud_.width;
  if (column <= left_ + kMargin || column >= right_ - kMargin || row <= top_ + kMargin ||
      row >= bottom_ - kMargin)
    return true;
  if (strip_ == 0 || column > first_column_[static_cast<std::size_t>(row)] + kMargin) return false;
  const double strip = column * static_cast<double>(cloud_.points[point].z());
  return std::abs(strip - strip_) < kStripScatter * strip_;
}

bool ImageBorder::cuts(std::span<const std::uint32_t> points) const {
  if (!organized_) return false;
  std::size_t count = 0;
  for (const std::uint32_t point : points)
    if (at_border(point) && ++count >= kFewestAtBorder) return true;
  return false;
}

ImageMargins ImageBorder::margins(std::span<const std::uint32_t> points) const {
  ImageMargins margins;
  if (!organized_ || focal_ == 0) return margins;
  // Angle from a ray to the ray `pixels` away, from the tangents of both angles.
  const auto narrow = [this](double& margin, double tangent, double pixels) {
    margin = std::min(margin, std::abs(std::atan(tangent + pixels / focal_) - std::atan(tangent)));
  };
  const int width = cloud_.width, height = cloud_.height;
  for (const std::uint32_t point : points) {
    const int row = static_cast<int>(point) / width, column = static_cast<int>(point) % width;
    const Eigen::Vector3d p_C = cloud_.points[point].cast<double>();
    const double right = p_C.x() / p_C.z(), down = p_C.y() / p_C.z();
    const double first = strip_ > 0 ? strip_ / p_C.z() : left_;
    if (first >= 0) narrow(margins.left, right, std::min(0.0, first - column));
    if (right_ < width) narrow(margins.right, right, right_ - column);
    if (top_ >= 0) narrow(margins.up, down, top_ - row);
    if (bottom_ < height) narrow(margins.down, down, bottom_ - row);
  }
  return margins;
}

}  // namespace walkman::perception
