#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// What the command line says about the robot, whatever else there is.
struct RobotCommandLine {
  std::vector<std::string> packages;
  bool fd = false;

  [[nodiscard]] RobotChoice choice() const;
};

/// `--package-path` and `--fd`.
void add_robot_options(CLI::App& command, RobotCommandLine& options);

/// `--robot`, for commands that know the robot and nothing around it.
void add_robot_file_option(CLI::App& command, std::string& file);

/// The description named by `--robot`, or WALK-MAN's own in the product's `data` where `file` is empty.
/// Throws as `load_robot_description`.
[[nodiscard]] RobotDescription described_robot(const std::string& file, const std::filesystem::path& data);

}  // namespace walkman::apps
