// The method's parameters in YAML.

#include <cmath>

#include "adaptation/parameters.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("parameters.yaml");
  file.write({data, size});
  file.read_or_refuse([] {
    const MethodParameters parameters = load_method_parameters(file.path());
    fuzz::require(std::isfinite(parameters.stage_one.reach) && parameters.stage_one.threads > 0 &&
                      parameters.stage_two.travel_speed > 0 && parameters.stage_two.max_regrasps >= 0,
                  "parameters are usable");
  });
  return 0;
}
