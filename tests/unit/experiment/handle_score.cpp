#include "tests/unit/experiment/handle_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "adaptation/motion/body_shape.h"
#include "sensors/stereo_camera.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr double kCentimetre = 0.01;
constexpr double kAround = 0.005;    // m outside a tube, where the fingers go
constexpr double kImageBorder = 20;  // pixels
constexpr double kHalfPalm = 0.055;  // m, of the paper's hand
constexpr int kSides = 24, kPalmSteps = 11;

}  // namespace

std::vector<Piece> pieces_of(const RobotModel& object, const Eigen::Isometry3d& X_CO,
                             const StageOneParameters& parameters) {
  const sensors::StereoOptions camera;
  const std::vector<Eigen::Isometry3d> X_OL = link_poses(object, {});
  const std::vector<motion::BodyShape> shapes = motion::body_shapes(object);
  const auto X_CS = [&](const motion::BodyShape& shape) -> Eigen::Isometry3d {
    return X_CO * X_OL[static_cast<std::size_t>(shape.link)] * shape.X_LS;
  };
  std::vector<Piece> pieces;
  for (const motion::BodyShape& tube : shapes) {
    if (!tube.cylinder) continue;
    const Eigen::Isometry3d X_CT = X_CS(tube);
    const double radius = tube.half.x();
    const bool fits = radius >= parameters.handle_min_radius && radius <= parameters.handle_max_radius;
    const auto beside = [&](double z, int side) -> Eigen::Vector3d {
      const double angle = 2 * std::numbers::pi * side / kSides;
      return X_CT *
             Eigen::Vector3d((radius + kAround) * std::cos(angle), (radius + kAround) * std::sin(angle), z);
    };
    const auto free = [&](double z) {
      for (int side = 0; side < kSides; ++side) {
        for (const motion::BodyShape& other : shapes) {
          if (&other == &tube) continue;
          const Eigen::Vector3d p_S = X_CS(other).inverse() * beside(z, side);
          if ((p_S - other.nearest_S(p_S)).norm() <= other.rounding) return false;
        }
      }
      return true;
    };
    const int count = static_cast<int>(2 * tube.half.z() / kCentimetre);
    for (int i = 0; i < count; ++i) {
      const double z = -tube.half.z() + (i + 0.5) * kCentimetre;
      Eigen::Vector3d top_C = beside(z, 0);
      for (int side = 1; side < kSides; ++side)
        if (beside(z, side).norm() < top_C.norm()) top_C = beside(z, side);
      const double u = camera.focal_px * top_C.x() / top_C.z() + camera.cx,
                   v = camera.focal_px * top_C.y() / top_C.z() + camera.cy;
      bool whole_palm = fits;
      for (int step = -kPalmSteps; step <= kPalmSteps; ++step)
        whole_palm = whole_palm && free(z + kHalfPalm * step / kPalmSteps);
      pieces.push_back({X_CT * Eigen::Vector3d(0, 0, z), X_CT.linear().col(2), radius, fits && free(z),
                        whole_palm,
                        u > kImageBorder && u < camera.width - kImageBorder && v > kImageBorder &&
                            v < camera.height - kImageBorder});
    }
  }
  return pieces;
}

Scored scored(const std::vector<Piece>& pieces, const std::vector<perception::Handle>& handles) {
  Scored out;
  const auto on_axis = [](const perception::Handle& handle, const Piece& piece) {
    const Eigen::Vector3d from_middle = piece.p_C - handle.p_CM;
    const double along = handle.axis_C.dot(from_middle);
    return (from_middle - along * handle.axis_C).norm() < kCentimetre
               ? along
               : std::numeric_limits<double>::infinity();
  };
  for (const Piece& piece : pieces) {
    if (!piece.takes_a_hand || !piece.seen) continue;
    ++out.graspable;
    out.found += std::any_of(handles.begin(), handles.end(), [&](const perception::Handle& handle) {
      const double along = on_axis(handle, piece);
      return std::isfinite(along) && std::abs(handle.nearest_graspable(along) - along) <= kCentimetre;
    });
  }
  for (const perception::Handle& handle : handles) {
    for (const double place : handle.places) {
      const Eigen::Vector3d p_C = handle.p_CM + place * handle.axis_C;
      const auto nearest =
          std::min_element(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
            // A place belongs to the tube it lies in or, where that is covered, to what covers it.
            const auto off = [&](const Piece& piece) {
              return (piece.p_C - p_C).norm() + (piece.holds ? 0 : kCentimetre);
            };
            return off(a) < off(b);
          });
      if (!nearest->holds || (nearest->p_C - p_C).norm() > kCentimetre) {
        ++out.wrong;
        continue;
      }
      out.worst_axis =
          std::max(out.worst_axis, std::acos(std::min(1.0, std::abs(nearest->axis_C.dot(handle.axis_C)))));
      out.worst_radius = std::max(out.worst_radius, std::abs(handle.radius - nearest->radius));
    }
  }
  return out;
}

}  // namespace walkman::apps
