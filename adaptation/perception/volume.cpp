#include "adaptation/perception/volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace walkman::perception {
namespace {

constexpr double kWidest = 1.5;      // largest |x/z| and |y/z| of a view
constexpr double kSteps = 3;         // points along a cell, so that dropouts leave few cells empty
constexpr double kPerCell = 3;       // steps of the plane of a tube in a cell
constexpr double kMostSteps = 2000;  // along that plane: bounds memory
constexpr double kOnTube =
    0.005;  // m from its surface: smoothed noise, and deviation of objects from cylinders
constexpr double kBehind = 1.5;  // cells: a surface closer than this behind a point may be its own

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
    return s > tube.from - kOnTube && s < tube.to + kOnTube &&
           std::abs(distance(p_C) - tube.radius) < kOnTube;
  }
};

/// Half the width of the object around a tube, over the upright plane of the tube's axis; around an upright
/// tube, its radius over the axis.
class HalfWidths {
 public:
  explicit HalfWidths(const TubeFrame& frame) : frame_(frame) {}

  void see(const Eigen::Vector3d& p_C) {
    Place at = place(p_C);
    if (frame_.upright) at = {at.s, 0, std::hypot(at.h, at.w)};
    seen_.push_back(at);
  }

  /// To be called after all points: bridges gaps of up to `gap` (m) between them, and adds the tube itself.
  void complete(double gap) {
    lay_out(gap);
    for (const Place& at : seen_) {
      float& w = widths_[index(at.s, at.h)];
      w = std::max(w, static_cast<float>(std::abs(at.w)));
    }
    const int half = static_cast<int>(std::ceil(gap / step_ / 2));
    filter(half, [](float a, float b) { return std::max(a, b); });
    filter(half, [](float a, float b) { return std::min(a, b); });
    add_tube();
  }

  [[nodiscard]] bool contains(const Eigen::Vector3d& p_C) const {
    const Place at = place(p_C);
    return std::abs(at.w) < half_width(at.s, at.h);
  }

  /// Calls `each` with points evenly spread in the volume, and the volume of each, m³.
  template <typename Each>
  void for_parts(double longest, const Each& each) const {
    for (int i = 0; i < along_; ++i) {
      const double s = s_ + (i + 0.5) * step_;
      const double radius = std::max(0.0F, widths_[static_cast<std::size_t>(i)]);
      const int rows = frame_.upright ? static_cast<int>(std::ceil(2 * radius / step_)) : up_;
      for (int j = 0; j < rows; ++j) {
        const double row = frame_.upright ? 2 * radius / rows : step_;
        const double h = (frame_.upright ? -radius : h_) + (j + 0.5) * row;
        const double w = half_width(s, h);
        if (!(w > 0)) continue;
        const int parts = static_cast<int>(std::ceil(2 * w / longest));
        for (int k = 0; k < parts; ++k) {
          const double t = w * ((2 * k + 1.0) / parts - 1);
          each(frame_.tube.p_CM + s * frame_.along + h * frame_.up + t * frame_.across,
               step_ * row * 2 * w / parts);
        }
      }
    }
  }

 private:
  /// Position from the tube's middle: along its axis, up and across, m.
  struct Place {
    double s = 0, h = 0, w = 0;
  };

  [[nodiscard]] Place place(const Eigen::Vector3d& p_C) const {
    const Eigen::Vector3d from_middle = p_C - frame_.tube.p_CM;
    return {frame_.along.dot(from_middle), frame_.up.dot(from_middle), frame_.across.dot(from_middle)};
  }

  /// Lays out the plane around all that was seen and the tube.
  void lay_out(double gap) {
    const Handle& tube = frame_.tube;
    const double r = frame_.upright ? 0 : tube.radius;
    double from = tube.from, to = tube.to, low = -r, high = r;
    for (const Place& at : seen_) {
      from = std::min(from, at.s);
      to = std::max(to, at.s);
      low = std::min(low, at.h);
      high = std::max(high, at.h);
    }
    step_ = std::max(gap / kPerCell, std::max(to - from, high - low) / kMostSteps);
    const double margin = 2 * gap;  // what the filters reach
    s_ = from - margin;
    h_ = frame_.upright ? -step_ / 2 : low - margin;
    along_ = static_cast<int>(std::ceil((to - from + 2 * margin) / step_)) + 1;
    up_ = frame_.upright ? 1 : static_cast<int>(std::ceil((high - low + 2 * margin) / step_)) + 1;
    widths_.assign(static_cast<std::size_t>(along_) * static_cast<std::size_t>(up_), kNothing);
  }

  [[nodiscard]] std::size_t index(double s, double h) const {
    const auto i = static_cast<std::size_t>((s - s_) / step_), j = static_cast<std::size_t>((h - h_) / step_);
    return j * static_cast<std::size_t>(along_) + i;
  }

  [[nodiscard]] double half_width(double s, double h) const {
    const bool inside = s >= s_ && s < s_ + along_ * step_;
    if (frame_.upright) {
      const double radius = inside ? std::max(0.0F, widths_[index(s, 0)]) : 0;
      return std::sqrt(std::max(0.0, radius * radius - h * h));
    }
    return inside && h >= h_ && h < h_ + up_ * step_ ? widths_[index(s, h)] : kNothing;
  }

  void add_tube() {
    const Handle& tube = frame_.tube;
    for (int j = 0; j < up_; ++j) {
      const double h = frame_.upright ? 0 : h_ + (j + 0.5) * step_;
      if (std::abs(h) >= tube.radius) continue;
      const auto w = static_cast<float>(std::sqrt(tube.radius * tube.radius - h * h));
      for (int i = 0; i < along_; ++i) {
        const double s = s_ + (i + 0.5) * step_;
        if (s < tube.from || s > tube.to) continue;
        float& there = widths_[static_cast<std::size_t>(j) * static_cast<std::size_t>(along_) +
                               static_cast<std::size_t>(i)];
        there = std::max(there, w);
      }
    }
  }

  /// Replaces each value by the largest or smallest of the square around it.
  template <typename Choose>
  void filter(int half, const Choose& choose) {
    filter_along(along_, up_, 1, along_, half, choose);
    filter_along(up_, along_, along_, 1, half, choose);
  }
  template <typename Choose>
  void filter_along(int count, int lines, int stride, int line_stride, int half, const Choose& choose) {
    std::vector<float> line(static_cast<std::size_t>(count));
    for (int l = 0; l < lines; ++l) {
      const auto at = [&](int i) -> float& {
        return widths_[static_cast<std::size_t>(l) * static_cast<std::size_t>(line_stride) +
                       static_cast<std::size_t>(i) * static_cast<std::size_t>(stride)];
      };
      for (int i = 0; i < count; ++i) {
        float chosen = at(i);
        for (int k = std::max(0, i - half); k <= std::min(count - 1, i + half); ++k)
          chosen = choose(chosen, at(k));
        line[static_cast<std::size_t>(i)] = chosen;
      }
      for (int i = 0; i < count; ++i) at(i) = line[static_cast<std::size_t>(i)];
    }
  }

  static constexpr float kNothing = -1;
  const TubeFrame& frame_;
  std::vector<Place> seen_;
  double s_ = 0, h_ = 0, step_ = 0;  // corner and step of the plane, m
  int along_ = 0, up_ = 0;
  std::vector<float> widths_;
};

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
  std::vector<HalfWidths> bodies(frames.begin(), frames.end());
  for (const Eigen::Vector3f& p : surface_C) {
    const Eigen::Vector3d p_C = p.cast<double>();
    const auto nearest = std::min_element(frames.begin(), frames.end(), [&](const auto& a, const auto& b) {
      return a.distance(p_C) < b.distance(p_C);
    });
    if (nearest->has(p_C)) continue;
    HalfWidths& body = bodies[static_cast<std::size_t>(nearest - frames.begin())];
    body.see(p_C);
    const double height = plane.n_C.dot(p_C) + plane.offset;
    if (height > lowest + cell) continue;
    const double step = cell / kPerCell;
    for (int i = 1; i * step < height; ++i) body.see(p_C - i * step * plane.n_C);
  }
  for (HalfWidths& body : bodies) body.complete(cell);
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double volume = 0;
  for (auto body = bodies.begin(); body != bodies.end(); ++body) {
    body->for_parts(cell, [&](const Eigen::Vector3d& p_C, double part) {
      if (plane.n_C.dot(p_C) + plane.offset < 0 || free.holds(p_C, kBehind * cell)) return;
      if (std::any_of(bodies.begin(), body, [&](const HalfWidths& one) { return one.contains(p_C); })) return;
      moment += part * p_C;
      volume += part;
    });
  }
  if (!(volume > 0)) return std::nullopt;
  return moment / volume;
}

}  // namespace walkman::perception
