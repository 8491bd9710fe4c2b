#include "apps/shared/robot_command_line.h"

namespace walkman::apps {

RobotChoice RobotCommandLine::choice() const { return {PackagePath(packages.begin(), packages.end()), fd}; }

void add_robot_options(CLI::App& command, RobotCommandLine& options) {
  command.add_option("--package-path", options.packages,
                     "Folder in which package://NAME of a mesh is looked up as NAME; may be repeated");
  command.add_flag("--fd", options.fd, "CAN FD on every bus; PDO layout d needs it");
}

void add_robot_file_option(CLI::App& command, std::string& file) {
  command.add_option("--robot", file, "Robot description (default: urdf/walkman.robot.yaml)");
}

RobotDescription described_robot(const std::string& file, const std::filesystem::path& data) {
  return load_robot_description(file.empty() ? data / "urdf" / "walkman.robot.yaml"
                                             : std::filesystem::path(file));
}

}  // namespace walkman::apps
