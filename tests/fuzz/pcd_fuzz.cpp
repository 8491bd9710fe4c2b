// A PCD file: header, and a body in text, binary or compressed form.

#include "adaptation/perception/pcd.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("cloud.pcd");
  file.write({data, size});
  file.read_or_refuse([] {
    const perception::RecordedCloud recorded = perception::read_pcd(file.path());
    const camera::OrganizedCloud& cloud = recorded.cloud;
    fuzz::require(
        cloud.points.size() == static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height),
        "a cloud has as many points as its width and height say");
    fuzz::require(recorded.X_FC.matrix().allFinite(), "the sensor is somewhere");
    for (const Eigen::Vector3f& point : cloud.points)
      fuzz::require(point.allFinite() || point.array().isNaN().all(),
                    "a point is finite, or not a number in all three");
  });
  return 0;
}
