#include "apps/picture/snapshot.h"

namespace walkman::apps {

Snapshot take_snapshot(const EmulatedWorld& world) {
  const plant::Plant& plant = world.emulator.plant();
  Snapshot snapshot;
  snapshot.at = world.emulator.now();
  for (std::size_t i = 0; i < world.robot.model.links.size(); ++i) {
    snapshot.X_WL.push_back(plant.X_WL(static_cast<int>(i)));
  }
  for (std::size_t i = 0; i < world.scene.objects.size(); ++i) {
    snapshot.X_WO.push_back(plant.X_WO(static_cast<int>(i)));
    snapshot.objects.push_back(plant.object(static_cast<int>(i)));
  }
  return snapshot;
}

}  // namespace walkman::apps
