#pragma once

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/shared/emulated_world.h"
#include "apps/shared/robot_command_line.h"

namespace walkman::apps {

/// Experiments of the paper: 1 to this; each is the scene `experiment_NUMBER`.
inline constexpr int kExperiments = 11;

/// What the command line says about the world: `--scene`, `--model-error` and the robot's options.
struct SceneCommandLine {
  std::string scene;
  std::string model_error;  ///< a level; empty: as the scene has it
  RobotCommandLine robot;
};

/// `default_scene` is for the help: which one it is without `--scene`.
CLI::Option* add_scene_options(CLI::App& command, SceneCommandLine& options,
                               const std::string& default_scene = "Experiment 1's");

/// The scene file: a path, or the name of one that comes with the program. Throws std::runtime_error that
/// lists those names when it is neither. `fallback` where no scene is named.
[[nodiscard]] std::filesystem::path scene_file(const std::string& scene, const std::filesystem::path& data,
                                               const std::string& fallback = "experiment_1");

/// The YAML with the method's parameters for a scene: its own, or the program's.
[[nodiscard]] std::filesystem::path parameters_file(const Scene& scene, const std::filesystem::path& data);

/// Scene, robot and actuators of a world as the command line says; the rest as it is made.
[[nodiscard]] WorldOptions world_of(const SceneCommandLine& options, const std::filesystem::path& data);

}  // namespace walkman::apps
