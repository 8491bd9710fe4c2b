#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "adaptation/parameters.h"
#include "adaptation/perception/pcd.h"
#include "adaptation/perception/stage_one.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"

namespace walkman::apps {
namespace {

using nlohmann::json;

json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json result_json(const perception::StageOneResult& result) {
  json out;
  out["plane"] = {{"normal", vector_json(result.plane.n_C)}, {"offset", result.plane.offset}};
  out["clusters"] = result.cluster_sizes;
  out["com"] = vector_json(result.p_CCm);
  out["handles"] = json::array();
  for (const perception::Handle& handle : result.handles) {
    out["handles"].push_back({{"centre", vector_json(handle.p_CM)},
                              {"axis", vector_json(handle.axis_C)},
                              {"radius", handle.radius},
                              {"extent", handle.to - handle.from},
                              {"from", handle.from},
                              {"to", handle.to},
                              {"places", handle.places.size()}});
  }
  if (result.grasp) {
    const Eigen::Isometry3d& X = result.grasp->X_CG;
    out["grasp"] = {{"handle", result.grasp->handle},         {"along", result.grasp->along},
                    {"origin", vector_json(X.translation())}, {"x", vector_json(X.linear().col(0))},
                    {"y", vector_json(X.linear().col(1))},    {"z", vector_json(X.linear().col(2))}};
  } else {
    out["grasp"] = nullptr;
  }
  out["seconds"] = json::object();
  for (const perception::StepTime& step : result.times) out["seconds"][step.step] = step.seconds;
  return out;
}

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("({:.4f}, {:.4f}, {:.4f})", v.x(), v.y(), v.z());
}

std::string result_text(const perception::StageOneResult& result) {
  std::string text = fmt::format("plane     normal {}  offset {:.4f} m\n", vector_text(result.plane.n_C),
                                 result.plane.offset);
  text += fmt::format("clusters  {}:", result.cluster_sizes.size());
  for (const std::size_t size : result.cluster_sizes) text += fmt::format(" {}", size);
  text += fmt::format(" points\nCoM       {} m\nhandles   {}\n", vector_text(result.p_CCm),
                      result.handles.size());
  for (std::size_t i = 0; i < result.handles.size(); ++i) {
    const perception::Handle& h = result.handles[i];
    text += fmt::format("  {:2}  centre {} m  axis {}  radius {:.1f} mm  extent {:.3f} m  {} places\n", i,
                        vector_text(h.p_CM), vector_text(h.axis_C), 1e3 * h.radius, h.to - h.from,
                        h.places.size());
  }
  if (result.grasp) {
    const Eigen::Isometry3d& X = result.grasp->X_CG;
    text += fmt::format(
        "grasp     handle {}, {:+.3f} m from its centre\n          origin {} m\n          x {}  y {}  z {}\n",
        result.grasp->handle, result.grasp->along, vector_text(X.translation()),
        vector_text(X.linear().col(0)), vector_text(X.linear().col(1)), vector_text(X.linear().col(2)));
  } else {
    text += "grasp     none: no handle of the hand's size\n";
  }
  double total = 0;
  for (const perception::StepTime& step : result.times) {
    total += step.seconds;
    text += fmt::format("  {:<24}{:8.1f} ms\n", step.step, 1e3 * step.seconds);
  }
  return text + fmt::format("  {:<24}{:8.1f} ms\n", "total", 1e3 * total);
}

}  // namespace

void add_locate_command(CLI::App& app, std::function<int()>& run) {
  struct Options {
    std::string cloud, parameters;
    bool as_json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("locate", "Run Stage I on a point cloud: plane, object, handles, grasp frame");
  command
      ->add_option("CLOUD.pcd", options->cloud,
                   "PCD file, ascii or binary, organized or not, in the optical frame")
      ->required();
  command->add_option("--parameters", options->parameters, "YAML of both stages' parameters");
  command->add_flag("--json", options->as_json, "Print JSON (SI units, the cloud's frame)");
  command->callback([&run, options] {
    run = [options] {
      const std::filesystem::path file = options->parameters.empty()
                                             ? data_directory() / "adaptation" / "parameters.yaml"
                                             : std::filesystem::path(options->parameters);
      const StageOneParameters parameters = load_method_parameters(file).stage_one;
      perception::StageOneResult result;
      try {
        result = perception::locate(perception::read_pcd(options->cloud), parameters);
      } catch (const std::runtime_error& e) {
        const std::string what = e.what();
        throw std::runtime_error(what.find(options->cloud) == std::string::npos ? options->cloud + ": " + what
                                                                                : what);
      }
      options->as_json ? print_json(result_json(result).dump(2) + "\n") : print(result_text(result));
      return result.grasp ? kOk : kTaskFailed;
    };
  });
}

}  // namespace walkman::apps
