#include "apps/shared/scene_options.h"

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/shared/data_directory.h"
#include "apps/shared/standard_streams.h"
#include "urdf/reader/nearest_name.h"

namespace walkman::apps {
namespace {

constexpr const char* kList = "list";

/// Names of the scenes that come with the program, sorted.
std::vector<std::string> shipped_scenes(const std::filesystem::path& data) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(data / "urdf" / "scenes", error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

CLI::Option* add_scene_options(CLI::App& command, SceneCommandLine& options,
                               const std::string& default_scene) {
  CLI::Option* scene =
      command.add_option("--scene", options.scene,
                         "Scene file, or the name of one that comes with the program; 'list' lists them "
                         "(default: " +
                             default_scene + ")");
  scene->each([](const std::string& named) {
    if (named != kList) return;
    for (const std::string& name : shipped_scenes(data_directory())) print(name + "\n");
    throw CLI::Success();
  });
  command
      .add_option("--model-error", options.model_error,
                  "How far the emulated robot is from its model, instead of the scene's own setting")
      ->check(CLI::IsMember(model_error_levels()));
  add_robot_options(command, options.robot);
  return scene;
}

std::filesystem::path scene_file(const std::string& scene, const std::filesystem::path& data,
                                 const std::string& fallback) {
  const std::string& named = scene.empty() ? fallback : scene;
  const std::vector<std::string> names = shipped_scenes(data);
  if (std::find(names.begin(), names.end(), named) != names.end())
    return data / "urdf" / "scenes" / (named + ".yaml");
  std::error_code error;
  if (std::filesystem::exists(named, error)) return named;
  throw std::runtime_error(fmt::format("--scene: {}: no such file or scene, expected a file or one of {}{}",
                                       named, fmt::join(names, ", "), did_you_mean(named, names)));
}

std::filesystem::path parameters_file(const Scene& scene, const std::filesystem::path& data) {
  return scene.parameters.empty() ? data / "adaptation" / "parameters.yaml" : scene.parameters;
}

WorldOptions world_of(const SceneCommandLine& options, const std::filesystem::path& data) {
  WorldOptions world;
  world.scene = scene_file(options.scene, data);
  if (!options.model_error.empty()) world.model_error = options.model_error;
  world.robot = options.robot.choice();
  world.actuators = data / "emulator" / "plant" / "actuators";
  return world;
}

}  // namespace walkman::apps
