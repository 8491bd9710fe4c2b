// state_hashes SECONDS WORLDS: prints the standing robot's state hash after each step of that many emulated
// seconds, one per line, for a world built WORLDS times in this process. Exits with code 1 if the worlds
// differ, or if the state is not that of a standing robot.

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "tests/bench/plant/plant_scenes.h"

int main(int argc, char** argv) {
  try {
    if (argc != 3) throw std::runtime_error("usage: state_hashes SECONDS WORLDS");
    const int steps = 1000 * std::atoi(argv[1]);
    const int worlds = std::atoi(argv[2]);
    if (steps <= 0 || worlds <= 0) throw std::runtime_error("SECONDS and WORLDS are whole numbers from 1");
    const walkman::bench::PlantScenes scenes(WALKMAN_URDF_DIR);
    std::vector<std::uint64_t> first;
    for (int world = 0; world < worlds; ++world) {
      const auto plant = scenes.standing();
      for (int i = 0; i < steps; ++i) {
        scenes.step(*plant, 0);
        const std::uint64_t hash = plant->state_hash();
        if (world == 0) {
          first.push_back(hash);
        } else if (first[static_cast<std::size_t>(i)] != hash) {
          throw std::runtime_error("world " + std::to_string(world + 1) + " differs at step " +
                                   std::to_string(i));
        }
      }
      if (plant->X_WL(0).translation().z() < 1.0) throw std::runtime_error("the robot does not stand");
    }
    for (const std::uint64_t hash : first) std::printf("%016" PRIx64 "\n", hash);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "state_hashes: %s\n", e.what());
    return 1;
  }
}
