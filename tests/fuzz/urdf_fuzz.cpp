// A URDF: if it loads, it is a tree in which everything is finite; a check of it reports the result in words
// and JSON.

#include <cmath>

#include <nlohmann/json.hpp>

#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"
#include "urdf/reader/model_check.h"
#include "urdf/reader/robot_model.h"

namespace walkman::fuzz {
namespace {

void require_tree(const RobotModel& model) {
  require(!model.links.empty() && model.links.size() == model.joints.size() + 1, "a model is a tree");
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Link& link = model.links[i];
    require(std::isfinite(link.mass) && link.p_LLcm.allFinite() && link.I_LLcm_L.allFinite(),
            "a link is finite");
    require((link.parent_joint < 0) == (i == 0), "the first link alone is the root");
  }
  for (const Joint& joint : model.joints) {
    require(joint.X_PJ.matrix().allFinite() && joint.axis.allFinite(), "a joint is finite");
    require(joint.parent_link >= 0 && joint.parent_link < joint.child_link &&
                joint.child_link < static_cast<int>(model.links.size()),
            "a parent comes before its child");
  }
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("robot.urdf");
  file.write({data, size});
  bool loaded = false;
  file.read_or_refuse([&] {
    fuzz::require_tree(load_robot_model(file.path()));
    loaded = true;
  });
  file.read_or_refuse([&] {
    const ModelReport report = check_model(file.path());
    fuzz::require(loaded == report.unusable.empty(),
                  "what cannot be loaded has something that cannot be used");
    fuzz::require(!to_text(report).empty(), "a report has words");
    fuzz::require(nlohmann::json::parse(to_json(report)).is_object(), "a report is JSON");
    loaded = false;
  });
  fuzz::require(!loaded, "what can be loaded can be checked");
  return 0;
}
