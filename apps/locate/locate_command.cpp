#include <cmath>
#include <optional>

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

nlohmann::json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// A result in the frame F of the cloud's file, in which the sensor has the pose `X_FC`.
struct Located {
  perception::StageOneResult result;
  Eigen::Isometry3d X_FC;

  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector3d& p_C) const { return X_FC * p_C; }
  [[nodiscard]] Eigen::Vector3d direction(const Eigen::Vector3d& v_C) const { return X_FC.linear() * v_C; }
  /// n_F · p_F + offset = 0 on the plane.
  [[nodiscard]] double plane_offset() const {
    return result.plane.offset - direction(result.plane.n_C).dot(X_FC.translation());
  }
};

nlohmann::json handle_json(const Located& located, const perception::Handle& handle) {
  return {{"centre", vector_json(located.point(handle.p_CM))},
          {"axis", vector_json(located.direction(handle.axis_C))},
          {"radius", handle.radius},
          {"extent", handle.to - handle.from},
          {"from", handle.from},
          {"to", handle.to},
          {"places", handle.places.size()},
          {"residual", handle.residual},
          {"arc", handle.arc},
          {"radius_deviation", handle.radius_deviation},
          {"position_deviation", handle.position_deviation},
          {"axis_deviation", handle.axis_deviation}};
}

nlohmann::json handles_json(const Located& located, const std::vector<perception::Handle>& handles) {
  nlohmann::json out = nlohmann::json::array();
  for (const perception::Handle& handle : handles) out.push_back(handle_json(located, handle));
  return out;
}

nlohmann::json result_json(const Located& located) {
  const perception::StageOneResult& result = located.result;
  nlohmann::json out;
  out["plane"] = {{"normal", vector_json(located.direction(result.plane.n_C))},
                  {"offset", located.plane_offset()}};
  out["sampling"] = {{"step", result.sampling.step}, {"noise", result.sampling.noise}};
  out["objects"] = nlohmann::json::array();
  out["clusters"] = nlohmann::json::array();
  for (const perception::SeenObject& object : result.objects) {
    out["clusters"].push_back(object.points);
    out["objects"].push_back({{"points", object.points},
                              {"com", vector_json(located.point(object.p_CCm))},
                              {"cut_by_image", object.cut_by_image},
                              {"handles", handles_json(located, object.handles)},
                              {"refused", handles_json(located, object.refused)}});
  }
  out["chosen"] = result.chosen;
  out["com"] = vector_json(located.point(result.object().p_CCm));
  out["cut_by_image"] = result.object().cut_by_image;
  out["handles"] = handles_json(located, result.object().handles);
  if (result.grasp) {
    const Eigen::Isometry3d X_FG = located.X_FC * result.grasp->X_CG;
    out["grasp"] = {{"handle", result.grasp->handle},
                    {"along", result.grasp->along},
                    {"origin", vector_json(X_FG.translation())},
                    {"x", vector_json(X_FG.linear().col(0))},
                    {"y", vector_json(X_FG.linear().col(1))},
                    {"z", vector_json(X_FG.linear().col(2))}};
  } else {
    out["grasp"] = nullptr;
  }
  out["seconds"] = nlohmann::json::object();
  for (const perception::StepTime& step : result.times) out["seconds"][step.step] = step.seconds;
  return out;
}

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("({:.4f}, {:.4f}, {:.4f})", v.x(), v.y(), v.z());
}

std::string handle_text(const Located& located, const perception::Handle& h) {
  return fmt::format(
      "centre {} m  axis {}  radius {:.1f} mm  extent {:.3f} m  {} places\n"
      "      residual {:.1f} mm  arc {:.0f}°  deviations: radius {:.2f} mm, position {:.2f} mm, axis "
      "{:.2f}°\n",
      vector_text(located.point(h.p_CM)), vector_text(located.direction(h.axis_C)), 1e3 * h.radius,
      h.to - h.from, h.places.size(), 1e3 * h.residual, h.arc * 180 / M_PI, 1e3 * h.radius_deviation,
      1e3 * h.position_deviation, h.axis_deviation * 180 / M_PI);
}

/// Lists the clusters other than the chosen one that have handles, for a result without any.
std::string others_text(const perception::StageOneResult& result) {
  std::string others;
  for (std::size_t i = 0; i < result.objects.size(); ++i)
    if (i != result.chosen && !result.objects[i].handles.empty())
      others += fmt::format("{}{} ({})", others.empty() ? "" : ", ", i, result.objects[i].handles.size());
  return others.empty() ? "no other cluster has any" : "clusters that have handles: " + others;
}

std::string result_text(const Located& located) {
  const perception::StageOneResult& result = located.result;
  const perception::SeenObject& chosen = result.object();
  std::string text = fmt::format(
      "plane     normal {}  offset {:.4f} m\nsampling  a point every {:.2f} mrad, noise {:.2f} mm at 1 m\n",
      vector_text(located.direction(result.plane.n_C)), located.plane_offset(), 1e3 * result.sampling.step,
      1e3 * result.sampling.deviation(1));
  text += fmt::format("clusters  {}\n", result.objects.size());
  for (std::size_t i = 0; i < result.objects.size(); ++i) {
    const perception::SeenObject& object = result.objects[i];
    text += fmt::format("{} {:2}  {} points  CoM {} m  {} handle{}{}\n", i == result.chosen ? " >" : "  ", i,
                        object.points, vector_text(located.point(object.p_CCm)), object.handles.size(),
                        object.handles.size() == 1 ? "" : "s",
                        object.cut_by_image ? "  cut by the image's border" : "");
  }
  text += fmt::format("object    {}\nCoM       {} m\nhandles   {}\n", result.chosen,
                      vector_text(located.point(chosen.p_CCm)), chosen.handles.size());
  for (std::size_t i = 0; i < chosen.handles.size(); ++i)
    text += fmt::format("  {:2}  {}", i, handle_text(located, chosen.handles[i]));
  if (!chosen.refused.empty()) text += "refused   not certainly of the hand's size\n";
  for (const perception::Handle& handle : chosen.refused)
    text += fmt::format("      {}", handle_text(located, handle));
  if (result.grasp) {
    const Eigen::Isometry3d X_FG = located.X_FC * result.grasp->X_CG;
    text += fmt::format(
        "grasp     handle {}, {:+.3f} m from its centre\n          origin {} m\n          x {}  y {}  z {}\n",
        result.grasp->handle, result.grasp->along, vector_text(X_FG.translation()),
        vector_text(X_FG.linear().col(0)), vector_text(X_FG.linear().col(1)),
        vector_text(X_FG.linear().col(2)));
  } else {
    text += fmt::format("grasp     none: no handle of the hand's size; {}\n", others_text(result));
  }
  double total = 0;
  for (const perception::StepTime& step : result.times) {
    total += step.seconds;
    text += fmt::format("  {:<24}{:8.1f} ms\n", step.step, 1e3 * step.seconds);
  }
  return text + fmt::format("  {:<24}{:8.1f} ms\n", "total", 1e3 * total);
}

struct LocateArguments {
  std::string cloud, parameters;
  std::vector<double> near;  // empty, or x, y, z in the file's frame
  bool as_json = false;
};

int run_locate(const LocateArguments& options) {
  const std::filesystem::path file = options.parameters.empty()
                                         ? data_directory() / "adaptation" / "parameters.yaml"
                                         : std::filesystem::path(options.parameters);
  const StageOneParameters parameters = load_method_parameters(file).stage_one;
  const perception::RecordedCloud recorded = perception::read_pcd(options.cloud);
  std::optional<Eigen::Vector3d> near_C;
  if (!options.near.empty())
    near_C = recorded.X_FC.inverse() * Eigen::Vector3d(options.near[0], options.near[1], options.near[2]);
  Located located{{}, recorded.X_FC};
  try {
    located.result = perception::locate(recorded.cloud, parameters, near_C);
  } catch (const perception::NotLocated& e) {
    say(options.cloud + ": " + e.what());
    return kTaskFailed;
  }
  options.as_json ? print_json(result_json(located).dump(2) + "\n") : print(result_text(located));
  return located.result.grasp ? kOk : kTaskFailed;
}

}  // namespace

void add_locate_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<LocateArguments>();
  CLI::App* command =
      app.add_subcommand("locate", "Run Stage I on a point cloud: plane, object, handles, grasp frame");
  command
      ->add_option("CLOUD.pcd", options->cloud,
                   "PCD file, ascii or binary, organized or not; VIEWPOINT is the sensor's pose")
      ->required();
  command->add_option("--parameters", options->parameters, "YAML of both stages' parameters");
  command
      ->add_option(
          "--near", options->near,
          "Choose the object nearest to this point (m, the file's frame), not the largest with handles")
      ->expected(3)
      ->type_name("FLOAT FLOAT FLOAT");
  command->add_flag("--json", options->as_json, "Print JSON (SI units, the file's frame)");
  command->callback([&run, options] { run = [options] { return run_locate(*options); }; });
}

}  // namespace walkman::apps
