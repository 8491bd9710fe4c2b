#include "adaptation/perception/stage_one.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "adaptation/perception/cluster.h"
#include "adaptation/perception/cylindrical_shell.h"
#include "adaptation/perception/handle_alignment.h"
#include "adaptation/perception/image_border.h"
#include "adaptation/perception/normals.h"
#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/plane.h"
#include "adaptation/perception/smoothing.h"
#include "adaptation/perception/volume.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr int kPlanes = 3;                    // stacked: floor, table, box
constexpr std::size_t kFewestOfCluster = 20;  // points of a cluster, whatever its size
constexpr std::size_t kSampled = 3000;        // points of an object, where all are compared
constexpr double kBridged = 6;                // missing points that do not split a cluster
constexpr double kVoxelSpacings = 2;          // points along the edge of a voxel
constexpr double kSmoothing = 1.48;           // radius over the cube root of noise times spacing
constexpr double kWidestSmoothing = 0.04;  // m; beyond it a second-degree surface no longer represents a tube

Eigen::Vector3d square_to(const Eigen::Vector3d& v, const Eigen::Vector3d& axis) {
  return (v - v.dot(axis) * axis).normalized();
}

class StepTimer {
 public:
  explicit StepTimer(std::vector<StepTime>& times) : times_(times) {}

  // A repeated step adds to its time.
  void done(const char* step) {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    const auto same =
        std::find_if(times_.begin(), times_.end(), [step](const StepTime& t) { return t.step == step; });
    if (same == times_.end())
      times_.push_back({step, seconds});
    else
      same->seconds += seconds;
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

/// The points of a cloud within reach, and their indices in it.
struct NearPoints {
  std::vector<Eigen::Vector3f> points_C;
  std::vector<std::uint32_t> numbers;
};

NearPoints points_in_reach(const camera::OrganizedCloud& cloud, double reach, int threads) {
  constexpr std::size_t kCloudPart = 32768;
  const auto limit = static_cast<float>(reach * reach);
  std::vector<NearPoints> parts((cloud.points.size() + kCloudPart - 1) / kCloudPart);
  for_ranges(threads, cloud.points.size(), kCloudPart, [&](std::size_t first, std::size_t last) {
    NearPoints& part = parts[first / kCloudPart];
    for (std::size_t i = first; i < last; ++i) {
      if (!(cloud.points[i].squaredNorm() < limit)) continue;  // also skips NaN
      part.points_C.push_back(cloud.points[i]);
      part.numbers.push_back(static_cast<std::uint32_t>(i));
    }
  });
  NearPoints near;
  for (const NearPoints& part : parts) {
    near.points_C.insert(near.points_C.end(), part.points_C.begin(), part.points_C.end());
    near.numbers.insert(near.numbers.end(), part.numbers.begin(), part.numbers.end());
  }
  return near;
}

template <typename T>
std::vector<T> members(const std::vector<T>& all, std::span<const std::uint32_t> chosen) {
  std::vector<T> out;
  out.reserve(chosen.size());
  for (const std::uint32_t i : chosen) out.push_back(all[i]);
  return out;
}

OrientedPoints above_only(const OrientedPoints& oriented, const Plane& plane, double height) {
  OrientedPoints out;
  for (std::size_t i = 0; i < oriented.points_C.size(); ++i) {
    if (plane.n_C.dot(oriented.points_C[i].cast<double>()) + plane.offset < height) continue;
    out.points_C.push_back(oriented.points_C[i]);
    out.normals_C.push_back(oriented.normals_C[i]);
  }
  return out;
}

double distance_to(std::span<const Eigen::Vector3f> points_C, const Eigen::Vector3d& p_C) {
  float least = std::numeric_limits<float>::infinity();
  for (const auto& p : points_C) least = std::min(least, (p - p_C.cast<float>()).squaredNorm());
  return std::sqrt(static_cast<double>(least));
}

/// Processes one cloud, from plane to objects.
class StageOne {
 public:
  StageOne(const camera::OrganizedCloud& cloud, const StageOneParameters& parameters,
           std::span<const Eigen::Vector3f> elsewhere_C)
      : parameters_(parameters), timer_(times_) {
    near_ = points_in_reach(cloud, parameters.reach, parameters.threads);
    of_cloud_ = near_.points_C.size();
    near_.points_C.insert(near_.points_C.end(), elsewhere_C.begin(), elsewhere_C.end());
    if (near_.points_C.empty())
      throw NotLocated("cloud: no finite point within the reach of " + rounded(parameters.reach) +
                       " m among " + std::to_string(cloud.points.size()) + " points");
    timer_.done("reach filter");
    sampling_ = measure_sampling(cloud, parameters.reach);
    timer_.done("sampling");
    oriented_ = estimate_normals(cloud, parameters.reach, sampling_, parameters.threads);
    all_oriented_ = oriented_.points_C.size();
    timer_.done("normals");
    border_.emplace(cloud);
    timer_.done("image border");
    if (parameters.look == Look::kAround) free_.emplace(cloud, sampling_.step);
    timer_.done("free space");
  }

  /// Returns the objects on the dominant plane of the points above all previous planes; nullopt without such
  /// a plane.
  std::optional<StageOneResult> next_plane(const std::optional<Eigen::Vector3d>& near_C) {
    StageOneResult result;
    result.sampling = sampling_;
    const auto plane = fit_dominant_plane(oriented_, all_oriented_, sampling_, parameters_);
    timer_.done("plane");
    if (!plane) return std::nullopt;
    result.plane = *plane;
    result.plane.hull_C = plane_hull(result.plane, oriented_, sampling_, parameters_);
    timer_.done("convex hull");
    if (result.plane.hull_C.empty()) return std::nullopt;
    const auto above = points_above(result.plane, near_.points_C, sampling_, parameters_);
    timer_.done("points above the plane");
    const auto clusters = clusters_of(above);
    timer_.done("clusters");
    std::vector<double> distances;
    for (const auto& cluster : clusters) {
      const std::vector<Eigen::Vector3f> measured = members(near_.points_C, cluster);
      auto object = judge(cluster, measured, result.plane);
      if (!object) continue;
      result.objects.push_back(std::move(*object));
      distances.push_back(near_C ? distance_to(measured, *near_C) : 0);
    }
    choose(result, distances);
    result.grasp = nearest_grasp(result);
    timer_.done("grasp frame");
    oriented_ = above_only(oriented_, result.plane, parameters_.above_plane);
    return result;
  }

  [[nodiscard]] std::size_t oriented_points() const { return all_oriented_; }
  std::vector<StepTime> take_times() { return std::move(times_); }

 private:
  // Clusters of the points `above`, as indices into the near points, without specks.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> clusters_of(
      const std::vector<std::uint32_t>& above) const {
    const auto points = members(near_.points_C, above);
    double range = 0;
    for (const auto& p : points) range += static_cast<double>(p.norm()) / static_cast<double>(points.size());
    const double tolerance = std::max(parameters_.cluster_tolerance, kBridged * sampling_.spacing(range));
    auto clusters = euclidean_clusters(points, tolerance, kFewestOfCluster);
    std::erase_if(clusters, [&](const auto& cluster) {
      double area = 0;
      for (const std::uint32_t i : cluster)
        area += std::pow(sampling_.spacing(static_cast<double>(points[i].norm())), 2);
      return area < parameters_.cluster_min_area;
    });
    for (auto& cluster : clusters)
      for (std::uint32_t& i : cluster) i = above[i];
    return clusters;
  }

  // Subsamples a cluster's points and, at the same rate, the points that rays beside it meet.
  void sample(const std::vector<std::uint32_t>& cluster, std::vector<Eigen::Vector3f>& of_object,
              std::vector<Eigen::Vector3f>& beyond) const {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t i : cluster) box.extend(near_.points_C[i]);
    const Eigen::Vector3f centre = box.center();
    const float radius = box.diagonal().norm() / 2 + static_cast<float>(parameters_.handle_max_radius);
    const std::size_t stride = std::max<std::size_t>(1, cluster.size() / kSampled);
    auto next = cluster.begin();  // ascending, like the near points
    for (std::size_t i = 0; i < of_cloud_; i += stride) {
      next = std::lower_bound(next, cluster.end(), static_cast<std::uint32_t>(i));
      const Eigen::Vector3f& p = near_.points_C[i];
      if (next != cluster.end() && *next == i) {
        of_object.push_back(p);
      } else if (const float along = p.dot(centre);
                 centre.squaredNorm() - along * along / p.squaredNorm() < radius * radius) {
        beyond.push_back(p);
      }
    }
  }

  // Returns nullopt if the cluster is too sparse to be smoothed.
  std::optional<SeenObject> judge(const std::vector<std::uint32_t>& cluster,
                                  const std::vector<Eigen::Vector3f>& measured, const Plane& plane) {
    const double range = median_range(measured);
    const double spacing = sampling_.spacing(range), deviation = sampling_.deviation(range);
    const double thin = std::max(parameters_.outlier_voxel, kVoxelSpacings * spacing);
    SeenObject object;
    object.points = cluster.size();
    auto kept = voxel_centroids(measured, thin);
    if (parameters_.outlier_neighbours > 0)
      kept = remove_outliers(kept, parameters_.outlier_neighbours, parameters_.outlier_deviations, thin,
                             parameters_.threads);
    timer_.done("outlier removal");
    // The scatter of a smoothed surface's curvature is proportional to the noise of a point times their
    // spacing over the radius cubed.
    const double least = parameters_.smoothing_radius;
    const double radius =
        std::clamp(kSmoothing * std::cbrt(deviation * spacing), least, std::max(least, kWidestSmoothing));
    object.surface_C =
        least > 0 ? smooth(kept, radius, std::max(parameters_.smoothing_voxel, thin), parameters_.threads)
                  : kept;
    timer_.done("smoothing");
    if (object.surface_C.empty()) return std::nullopt;
    const auto shells = find_shells(object.surface_C, parameters_);
    timer_.done("handle shells");
    if (shells.size() >= static_cast<std::size_t>(parameters_.handle_min_inliers)) {
      std::vector<Eigen::Vector3f> of_object, beyond;
      sample(cluster, of_object, beyond);
      AlignedHandles aligned =
          align_handles(shells, {object.surface_C, measured, of_object, beyond}, sampling_, parameters_);
      object.handles = std::move(aligned.handles);
      object.refused = std::move(aligned.refused);
    }
    timer_.done("handle alignment");
    object.p_CCm = median_of_voxel_centroids(object.surface_C, parameters_.centroid_voxel);
    if (free_) {
      std::vector<Handle> tubes = object.handles;
      tubes.insert(tubes.end(), object.refused.begin(), object.refused.end());
      object.p_CCm =
          volume_centroid(object.surface_C, plane, tubes, *free_,
                          least_height(plane, range, sampling_, parameters_), parameters_.centroid_voxel)
              .value_or(object.p_CCm);
    }
    timer_.done("centre of mass");
    const auto from_elsewhere =
        std::lower_bound(cluster.begin(), cluster.end(), static_cast<std::uint32_t>(of_cloud_));
    const auto numbers = members(near_.numbers, std::span(cluster.begin(), from_elsewhere));
    object.cut_by_image = border_->cuts(numbers);
    object.to_border = border_->margins(numbers);
    timer_.done("image border");
    return object;
  }

  // `distances`: of the objects from the requested point; zeros if there is none.
  static void choose(StageOneResult& result, const std::vector<double>& distances) {
    const auto& objects = result.objects;
    for (std::size_t i = 1; i < objects.size(); ++i)
      if (distances[i] < distances[result.chosen] ||
          (distances[i] == distances[result.chosen] && objects[result.chosen].handles.empty() &&
           !objects[i].handles.empty()))
        result.chosen = i;
    result.distance_asked = distances.empty() ? 0 : distances[result.chosen];
  }

  static double median_range(const std::vector<Eigen::Vector3f>& points) {
    std::vector<float> ranges;
    ranges.reserve(points.size());
    for (const auto& p : points) ranges.push_back(p.norm());
    const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
    std::nth_element(ranges.begin(), middle, ranges.end());
    return static_cast<double>(*middle);
  }

  const StageOneParameters& parameters_;
  std::vector<StepTime> times_;
  StepTimer timer_;
  NearPoints near_;           // the cloud's, then those from elsewhere, which have no index in it
  std::size_t of_cloud_ = 0;  // number of the cloud's points in near_
  Sampling sampling_;
  OrientedPoints oriented_;
  std::size_t all_oriented_ = 0;
  std::optional<ImageBorder> border_;
  std::optional<FreeSpace> free_;  // if the centre of mass is to be that of the volume
};

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

std::optional<GraspFrame> nearest_grasp(const StageOneResult& result) {
  std::optional<GraspFrame> best;
  double nearest = std::numeric_limits<double>::infinity();
  if (result.objects.empty()) return best;
  const SeenObject& object = result.object();
  for (std::size_t i = 0; i < object.handles.size(); ++i) {
    const Handle& handle = object.handles[i];
    const double along = handle.nearest_graspable(handle.axis_C.dot(object.p_CCm - handle.p_CM));
    const double distance = (handle.p_CM + along * handle.axis_C - object.p_CCm).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    best = grasp_frame_at(result, static_cast<int>(i), along);
  }
  return best;
}

GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along) {
  const std::size_t handles = result.objects.empty() ? 0 : result.object().handles.size();
  if (handle < 0 || static_cast<std::size_t>(handle) >= handles)
    throw std::out_of_range("grasp_frame_at: handle " + std::to_string(handle) + " of " +
                            std::to_string(handles) + " does not exist");
  const Handle& h = result.object().handles[static_cast<std::size_t>(handle)];
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

StageOneResult locate(const camera::OrganizedCloud& cloud, const StageOneParameters& parameters,
                      const std::optional<Eigen::Vector3d>& near_C,
                      std::span<const Eigen::Vector3f> elsewhere_C) {
  if (cloud.width < 0 || cloud.height < 0 ||
      cloud.points.size() != static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height))
    throw std::invalid_argument("cloud: " + std::to_string(cloud.points.size()) + " points, expected width " +
                                std::to_string(cloud.width) + " times height " +
                                std::to_string(cloud.height));
  StageOne stage(cloud, parameters, elsewhere_C);
  std::optional<StageOneResult> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (int level = 0; level < kPlanes; ++level) {
    auto result = stage.next_plane(near_C);
    if (!result) break;
    if (result->objects.empty()) {
      if (!best) best = std::move(result);
      continue;
    }
    const double distance = near_C ? result->distance_asked : 0;
    const bool graspable = result->grasp && distance <= parameters.asked_distance;
    if (graspable || !best || best->objects.empty() || distance < best_distance) {
      best = std::move(result);
      best_distance = distance;
    }
    if (graspable) break;
  }
  if (!best)
    throw NotLocated("cloud: no dominant plane; none holds " + rounded(100 * parameters.plane_min_share) +
                     " % of the " + std::to_string(stage.oriented_points()) + " points with a normal");
  if (best->objects.empty())
    throw NotLocated("cloud: no object on the plane; no cluster of " +
                     rounded(1e4 * parameters.cluster_min_area) + " cm² above it");
  if (best_distance > parameters.asked_distance)
    throw NotLocated("cloud: no object within " + rounded(parameters.asked_distance) +
                     " m of the requested point; the nearest is " + rounded(best_distance) + " m away");
  best->times = stage.take_times();
  return std::move(*best);
}

}  // namespace walkman::perception
