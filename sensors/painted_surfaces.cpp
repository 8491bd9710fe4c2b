#include "sensors/painted_surfaces.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace walkman::sensors {

void PaintedSurfaces::begin(const RayScene& scene, std::uint64_t seed, Moved moved) {
  constexpr std::size_t kMostBodies = 65536;
  const auto [fixed, movable] = RaySceneAccess::triangles(scene);
  const std::size_t bodies = fixed.body_ends.size() + movable.body_ends.size();
  if (bodies > kMostBodies) throw std::invalid_argument("sensors: more than 65536 bodies in the scene");
  const bool placed = moved == Moved::kPlaced;
  scene_ = placed ? RaySceneAccess::placed_scene(scene) : RaySceneAccess::embree_scene(scene);
  if (scene_ == nullptr) throw std::logic_error("RayScene: used before its bodies were placed");
  if (!pattern_ || seed != seed_ || X_PW_.size() != bodies) pattern_.emplace(seed, bodies);
  seed_ = seed;
  first_movable_ = static_cast<std::uint32_t>(fixed.triangles.size());
  if (body_.size() != fixed.triangles.size() + movable.triangles.size()) {
    body_.clear();
    first_of_.assign(1, first_movable_);
    for (const std::size_t end : movable.body_ends)
      first_of_.push_back(first_movable_ + static_cast<std::uint32_t>(end));
    std::uint16_t body = 0;
    for (const auto& [ends, before] :
         {std::pair{fixed.body_ends, std::size_t{0}}, std::pair{movable.body_ends, fixed.triangles.size()}}) {
      for (const std::size_t end : ends) body_.resize(before + end, body++);
    }
  }
  X_PW_.clear();
  for (std::size_t i = 0; i < fixed.body_ends.size(); ++i) X_PW_.push_back(pattern_->X_PB(i));
  for (const Eigen::Isometry3d& X_WB :
       placed ? RaySceneAccess::placed_poses(scene) : RaySceneAccess::poses(scene))
    X_PW_.push_back(pattern_->X_PB(X_PW_.size()) * X_WB.inverse());
}

void PaintedSurfaces::face(const RayScene& scene, const Eigen::Vector3f& p_WCo, tbb::task_arena& arena) {
  constexpr int kPerJob = 4096;
  sides_.resize(triangles());
  Side* side = sides_.data();
  for (const TriangleView& view : RaySceneAccess::triangles(scene)) {
    const auto vertex = [&](std::uint32_t i) {
      return Eigen::Map<const Eigen::Vector3f>(view.vertices.data() + std::size_t{3} * i);
    };
    const int count = static_cast<int>(view.triangles.size());
    run_jobs(arena, (count + kPerJob - 1) / kPerJob, [&](int job, int) {
      const int end = std::min((job + 1) * kPerJob, count);
      for (int i = job * kPerJob; i < end; ++i) {
        const auto& corners = view.triangles[static_cast<std::size_t>(i)];
        const Eigen::Vector3f a = vertex(corners[0]);
        const Eigen::Vector3f n = (vertex(corners[1]) - a).cross(vertex(corners[2]) - a);
        const float length = n.norm(), along = n.dot(p_WCo - a);
        // One without area has no normal, and no ray hits it.
        const float scale = length > 0 ? (along < 0 ? -1 : 1) / length : 0;
        side[i] = {scale * n, scale * along};
      }
    });
    side += count;
  }
}

}  // namespace walkman::sensors
