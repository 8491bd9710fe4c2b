#include "sensors/painted_surfaces.h"

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
  if (!pattern_ || seed != seed_ || X_BW_.size() != bodies) pattern_.emplace(seed, bodies);
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
  X_BW_.assign(fixed.body_ends.size(), Eigen::Isometry3d::Identity());
  for (const Eigen::Isometry3d& X_WB :
       placed ? RaySceneAccess::placed_poses(scene) : RaySceneAccess::poses(scene))
    X_BW_.push_back(X_WB.inverse());
}

}  // namespace walkman::sensors
