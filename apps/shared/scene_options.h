#pragma once

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/shared/emulated_world.h"
#include "apps/shared/robot_command_line.h"

namespace walkman::apps {

/// The paper's experiments are numbered from 1 to this; each is the scene `experiment_NUMBER`.
inline constexpr int kExperiments = 11;

/// The command line's options for the world: `--scene`, `--model-error` and the robot's options.
struct SceneCommandLine {
  std::string scene;
  std::string model_error;  ///< a level; empty: the scene's
  RobotCommandLine robot;
};

/// `default_scene` is for the help: the scene used without `--scene`.
CLI::Option* add_scene_options(CLI::App& command, SceneCommandLine& options,
                               const std::string& default_scene = "Experiment 1's");

/// Returns the scene file: a path, or the name of one that comes with the program. Throws std::runtime_error
/// that lists those names if it is neither. `fallback` is used if no scene is named.
[[nodiscard]] std::filesystem::path scene_file(const std::string& scene, const std::filesystem::path& data,
                                               const std::string& fallback = "experiment_1");

/// The YAML file with the method's parameters for a scene: the scene's own, or the program's.
[[nodiscard]] std::filesystem::path parameters_file(const Scene& scene, const std::filesystem::path& data);

/// A world with the scene, robot and actuators given on the command line; the rest by default.
[[nodiscard]] WorldOptions world_of(const SceneCommandLine& options, const std::filesystem::path& data);

}  // namespace walkman::apps
