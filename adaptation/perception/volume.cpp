#include "adaptation/perception/volume.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace walkman::perception {
namespace {

constexpr double kWidest = 1.5;   // largest |x/z| and |y/z| of a view
constexpr double kSteps = 3;      // points along a cell, so that dropouts leave few cells empty
constexpr double kPerCell = 0.5;  // fraction of a voxel between two filled points
constexpr double kOnTube =
    0.005;  // m from its surface: smoothed noise, and deviation of objects from cylinders
constexpr double kBehind = 1.5;  // voxels: a surface closer than this behind a point may be its own

/// Axes of a tube: along, up and across.
struct TubeFrame {
  TubeFrame(const Handle& handle, const Eigen::Vector3d& n_C)
      : tube(handle), along(handle.axis_C.normalized()) {
    up = n_C - n_C.dot(along) * along;
    upright = up.norm() < kUpright;
    up = upright ? along.unitOrthogonal() : Eigen::Vector3d(up.normalized());
    across = along.cross(up);
  }
  const Handle& tube;
  Eigen::Vector3d along, up, across;
  bool upright = false;

  /// Distance from the axis between the tube's ends, m.
  [[nodiscard]] double distance(const Eigen::Vector3d& p_C) const {
    const Eigen::Vector3d from_middle = p_C - tube.p_CM;
    const double s = std::clamp(along.dot(from_middle), tube.from, tube.to);
    return (from_middle - s * along).norm();
  }
  /// Whether a point lies on the tube's own surface.
  [[nodiscard]] bool has(const Eigen::Vector3d& p_C) const {
    const double s = along.dot(p_C - tube.p_CM);
    return s >= tube.from && s <= tube.to && std::abs(distance(p_C) - tube.radius) < kOnTube;
  }
};

/// Set of voxels, each counted once.
class Filled {
 public:
  explicit Filled(double cell) : cell_(cell) {}
  void add(const Eigen::Vector3d& p_C) {
    const Eigen::Array3d at = (p_C.array() / cell_).floor() + kOffset;
    keys_.push_back((static_cast<std::uint64_t>(at.x()) << 42) | (static_cast<std::uint64_t>(at.y()) << 21) |
                    static_cast<std::uint64_t>(at.z()));
  }
  /// Mean of the centres of all voxels except those for which `left_out` returns true.
  template <typename LeftOut>
  [[nodiscard]] std::optional<Eigen::Vector3d> centroid(const LeftOut& left_out) {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
    for (const std::uint64_t key : keys_) {
      constexpr std::uint64_t kMask = (1U << 21) - 1;
      const Eigen::Array3d at(static_cast<double>(key >> 42), static_cast<double>((key >> 21) & kMask),
                              static_cast<double>(key & kMask));
      const Eigen::Vector3d p_C = (at - kOffset + 0.5) * cell_;
      if (left_out(p_C)) continue;
      sum += p_C;
      count += 1;
    }
    if (count == 0) return std::nullopt;
    return sum / count;
  }

 private:
  static constexpr double kOffset = 1 << 20;  // makes cell indices positive
  double cell_;
  std::vector<std::uint64_t> keys_;
};

/// Calls `each` at positions from −half to half, both included.
template <typename Each>
void for_span(double half, double step, const Each& each) {
  const int count = static_cast<int>(std::ceil(half / step));
  for (int i = -count; i <= count; ++i) each(count == 0 ? 0 : half * i / count);
}

void fill_across(const TubeFrame& frame, const Eigen::Vector3d& p_C, double step, Filled& filled) {
  const Eigen::Vector3d from_middle = p_C - frame.tube.p_CM;
  const double h = frame.up.dot(from_middle), w = frame.across.dot(from_middle);
  const Eigen::Vector3d axis = frame.tube.p_CM + frame.along.dot(from_middle) * frame.along;
  if (!frame.upright) {
    for_span(std::abs(w), step, [&](double t) { filled.add(axis + h * frame.up + t * frame.across); });
    return;
  }
  const double radius = std::hypot(h, w);
  for_span(radius, step, [&](double t) {
    for_span(std::sqrt(std::max(0.0, radius * radius - t * t)), step,
             [&](double u) { filled.add(axis + u * frame.up + t * frame.across); });
  });
}

void fill_tube(const TubeFrame& frame, double step, Filled& filled) {
  const Handle& tube = frame.tube;
  const Eigen::Vector3d middle = tube.p_CM + (tube.from + tube.to) / 2 * frame.along;
  for_span((tube.to - tube.from) / 2, step, [&](double s) {
    for_span(tube.radius, step, [&](double h) {
      for_span(std::sqrt(std::max(0.0, tube.radius * tube.radius - h * h)), step,
               [&](double t) { filled.add(middle + s * frame.along + h * frame.up + t * frame.across); });
    });
  });
}

}  // namespace

FreeSpace::FreeSpace(const camera::OrganizedCloud& cloud, double step)
    : width_(std::max(kSteps * step, 1e-3)), side_(static_cast<int>(std::ceil(2 * kWidest / width_))) {
  nearest_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_),
                  std::numeric_limits<float>::infinity());
  for (const Eigen::Vector3f& p_C : cloud.points) {
    if (!(p_C.z() > 0)) continue;  // also skips NaN
    const int at = cell(p_C.x() / p_C.z(), p_C.y() / p_C.z());
    if (at < 0) continue;
    float& nearest = nearest_[static_cast<std::size_t>(at)];
    nearest = std::min(nearest, p_C.z());
  }
}

int FreeSpace::cell(float x_over_z, float y_over_z) const {
  const double u = std::floor((static_cast<double>(x_over_z) + kWidest) / width_),
               v = std::floor((static_cast<double>(y_over_z) + kWidest) / width_);
  if (!(u >= 0 && u < side_ && v >= 0 && v < side_)) return -1;
  return static_cast<int>(v) * side_ + static_cast<int>(u);
}

bool FreeSpace::holds(const Eigen::Vector3d& p_C, double margin) const {
  if (!(p_C.z() > 0)) return false;
  const int at = cell(static_cast<float>(p_C.x() / p_C.z()), static_cast<float>(p_C.y() / p_C.z()));
  if (at < 0) return false;
  const auto nearest = static_cast<double>(nearest_[static_cast<std::size_t>(at)]);
  return std::isfinite(nearest) && nearest > p_C.z() + margin;
}

std::optional<Eigen::Vector3d> volume_centroid(std::span<const Eigen::Vector3f> surface_C, const Plane& plane,
                                               std::span<const Handle> tubes, const FreeSpace& free,
                                               double lowest, double cell) {
  std::vector<TubeFrame> frames;
  for (const Handle& tube : tubes) frames.emplace_back(tube, plane.n_C);
  if (frames.empty()) return std::nullopt;
  Filled filled(cell);
  for (const TubeFrame& frame : frames) fill_tube(frame, kPerCell * cell, filled);
  for (const Eigen::Vector3f& p : surface_C) {
    const Eigen::Vector3d p_C = p.cast<double>();
    const auto nearest = std::min_element(frames.begin(), frames.end(), [&](const auto& a, const auto& b) {
      return a.distance(p_C) < b.distance(p_C);
    });
    if (nearest->has(p_C)) continue;
    const double height = plane.n_C.dot(p_C) + plane.offset;
    fill_across(*nearest, p_C, kPerCell * cell, filled);
    if (height > lowest + cell) continue;
    const double step = kPerCell * cell;
    for (int i = 1; i * step < height; ++i) fill_across(*nearest, p_C - i * step * plane.n_C, step, filled);
  }
  return filled.centroid([&](const Eigen::Vector3d& p_C) {
    // Voxels protrude on all sides from what they represent.
    return plane.n_C.dot(p_C) + plane.offset < -cell || free.holds(p_C, kBehind * cell);
  });
}

}  // namespace walkman::perception
