// A scene in YAML, with the robot, objects and surroundings that it may name.

#include "emulator/scene/scene.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("urdf/scenes/input.yaml", WALKMAN_SOURCE_TREE);
  file.write({data, size});
  file.read_or_refuse([] {
    Scene scene = load_scene(file.path());
    apply_jitter(scene, 3);
    fuzz::require(scene.X_WB.matrix().allFinite(), "the robot's base is somewhere");
    for (const SceneObject& object : scene.objects)
      fuzz::require(object.X_WO.matrix().allFinite() && object.mass() > 0 && object.p_OOcm().allFinite(),
                    "an object is somewhere and has a mass");
  });
  return 0;
}
