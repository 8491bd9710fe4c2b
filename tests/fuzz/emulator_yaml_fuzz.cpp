// The files that only the emulator reads, each read as every kind of them: actuators, force/torque sensors,
// the camera, the spread of the true robot.

#include "emulator/camera/camera_parameters.h"
#include "emulator/nodes/measuring/force_torque_kind.h"
#include "emulator/plant/actuators/actuator_parameters.h"
#include "emulator/scene/model_error.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("input.yaml");
  static const ModelErrorChoice calibrated{"calibrated", {}, {}};
  file.write({data, size});
  file.read_or_refuse([] { static_cast<void>(load_camera_parameters(file.path())); });
  file.read_or_refuse([] { static_cast<void>(load_force_torque_kind(file.path())); });
  file.read_or_refuse([] { static_cast<void>(load_model_error(file.path(), calibrated)); });
  file.read_or_refuse([] { static_cast<void>(plant::load_actuators(file.path().parent_path())); });
  return 0;
}
