#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// The command line's options for the robot alone.
struct RobotCommandLine {
  std::vector<std::string> packages;
  bool fd = false;

  [[nodiscard]] RobotChoice choice() const;
};

/// Adds `--package-path` and `--fd`.
void add_robot_options(CLI::App& command, RobotCommandLine& options);

/// Adds `--robot`, for commands that know the robot and nothing around it.
void add_robot_file_option(CLI::App& command, std::string& file);

/// Loads the description named by `--robot`, or WALK-MAN's own in the product's `data` if `file` is empty.
/// Throws as `load_robot_description` does.
[[nodiscard]] RobotDescription described_robot(const std::string& file, const std::filesystem::path& data);

}  // namespace walkman::apps
