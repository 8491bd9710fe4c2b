#include "adaptation/perception/stage_one.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "adaptation/perception/cluster.h"
#include "adaptation/perception/cylindrical_shell.h"
#include "adaptation/perception/handle_alignment.h"
#include "adaptation/perception/normals.h"
#include "adaptation/perception/plane.h"
#include "adaptation/perception/smoothing.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr double kUpright = 0.0872;  // sine of 5°

Eigen::Vector3d square_to(const Eigen::Vector3d& v, const Eigen::Vector3d& axis) {
  return (v - v.dot(axis) * axis).normalized();
}

class StepTimer {
 public:
  explicit StepTimer(std::vector<StepTime>& times) : times_(times) {}

  void done(const char* step) {
    const auto now = Clock::now();
    times_.push_back({step, std::chrono::duration<double>(now - last_).count()});
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::vector<StepTime>& times_;
  Clock::time_point last_ = Clock::now();
};

std::string rounded(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  return text.back() == '.' ? text + "0" : text;
}

std::vector<Eigen::Vector3f> points_in_reach(const camera::OrganizedCloud& cloud, double reach) {
  const auto limit = static_cast<float>(reach * reach);
  std::vector<Eigen::Vector3f> near;
  near.reserve(cloud.points.size());
  for (const auto& p : cloud.points)
    if (p.squaredNorm() < limit) near.push_back(p);  // false for NaN
  return near;
}

std::vector<Eigen::Vector3f> members(std::span<const Eigen::Vector3f> points,
                                     const std::vector<std::uint32_t>& chosen) {
  std::vector<Eigen::Vector3f> out;
  out.reserve(chosen.size());
  for (const std::uint32_t i : chosen) out.push_back(points[i]);
  return out;
}

std::optional<GraspFrame> nearest_grasp(const StageOneResult& result) {
  std::optional<GraspFrame> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < result.handles.size(); ++i) {
    const Handle& handle = result.handles[i];
    const double along = handle.nearest_graspable(handle.axis_C.dot(result.p_CCm - handle.p_CM));
    const double distance = (handle.p_CM + along * handle.axis_C - result.p_CCm).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    best = grasp_frame_at(result, static_cast<int>(i), along);
  }
  return best;
}

}  // namespace

double Handle::nearest_graspable(double along) const {
  along = std::clamp(along, from, to);
  double best = along, distance = std::numeric_limits<double>::infinity();
  for (const double place : places) {
    const double candidate = std::clamp(along, std::max(from, place - reach), std::min(to, place + reach));
    if (std::abs(candidate - along) >= distance) continue;
    distance = std::abs(candidate - along);
    best = candidate;
  }
  return best;
}

GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along) {
  if (handle < 0 || static_cast<std::size_t>(handle) >= result.handles.size())
    throw std::out_of_range("grasp_frame_at: handle " + std::to_string(handle) + " of " +
                            std::to_string(result.handles.size()) + " does not exist");
  const Handle& h = result.handles[static_cast<std::size_t>(handle)];
  GraspFrame frame;
  frame.handle = handle;
  frame.along = std::clamp(along, h.from, h.to);
  const Eigen::Vector3d on_axis = h.p_CM + frame.along * h.axis_C;
  const Eigen::Vector3d x = h.axis_C.normalized();
  const bool upright = x.cross(result.plane.n_C).norm() < kUpright;
  const Eigen::Vector3d y = upright ? square_to(-on_axis, x).cross(x) : square_to(result.plane.n_C, x);
  frame.X_CG.linear().col(0) = x;
  frame.X_CG.linear().col(1) = y;
  frame.X_CG.linear().col(2) = x.cross(y);
  frame.X_CG.translation() = on_axis + h.radius * y;
  return frame;
}

StageOneResult locate(const camera::OrganizedCloud& cloud, const StageOneParameters& parameters) {
  if (cloud.width < 0 || cloud.height < 0 ||
      cloud.points.size() != static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height))
    throw NotLocated("cloud: " + std::to_string(cloud.points.size()) + " points where width " +
                     std::to_string(cloud.width) + " times height " + std::to_string(cloud.height) +
                     " was expected");
  StageOneResult result;
  StepTimer timer(result.times);

  const auto near = points_in_reach(cloud, parameters.reach);
  if (near.empty())
    throw NotLocated("cloud: no finite point within the reach of " + rounded(parameters.reach) + " m among " +
                     std::to_string(cloud.points.size()) + " points");
  timer.done("reach filter");
  const auto oriented = estimate_normals(cloud, parameters.reach);
  timer.done("normals");
  const auto plane = fit_dominant_plane(oriented, parameters);
  if (!plane)
    throw NotLocated("cloud: no dominant plane; none holds " + rounded(100 * parameters.plane_min_share) +
                     " % of the " + std::to_string(oriented.points_C.size()) + " points with a normal");
  result.plane = *plane;
  timer.done("plane");
  result.plane.hull_C = plane_hull(result.plane, oriented, parameters);
  if (result.plane.hull_C.empty()) throw NotLocated("cloud: the dominant plane spans no area");
  timer.done("convex hull");
  const auto above = points_above(result.plane, near, parameters.above_plane, parameters.highest_above_plane);
  timer.done("points above the plane");
  const auto clusters = euclidean_clusters(above, parameters.cluster_tolerance,
                                           static_cast<std::size_t>(parameters.cluster_min_points));
  if (clusters.empty())
    throw NotLocated("cloud: no object on the plane; no cluster of " +
                     std::to_string(parameters.cluster_min_points) + " points among the " +
                     std::to_string(above.size()) + " above it");
  for (const auto& cluster : clusters) result.cluster_sizes.push_back(cluster.size());
  const auto measured = members(above, clusters.front());
  timer.done("clusters");
  const auto kept = remove_outliers(voxel_centroids(measured, parameters.outlier_voxel),
                                    parameters.outlier_neighbours, parameters.outlier_deviations);
  timer.done("outlier removal");
  result.object_C = smooth(kept, parameters.smoothing_radius, parameters.smoothing_voxel, parameters.threads);
  if (result.object_C.empty())
    throw NotLocated("cloud: the largest cluster of " + std::to_string(measured.size()) +
                     " points is too sparse to smooth");
  timer.done("smoothing");
  const auto shells = find_shells(result.object_C, parameters);
  timer.done("handle shells");
  result.handles = align_handles(shells, measured, parameters);
  timer.done("handle alignment");
  result.p_CCm = median_of_voxel_centroids(result.object_C, parameters.centroid_voxel);
  timer.done("centre of mass");
  result.grasp = nearest_grasp(result);
  timer.done("grasp frame");
  return result;
}

}  // namespace walkman::perception
