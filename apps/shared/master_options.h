#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// What the command line says about the master: `--layout` and `--rate`.
struct MasterOptions {
  std::string layout;             ///< name of one of the robot's, or a file; the robot's own if empty
  std::optional<double> rate_hz;  ///< of SYNC; 200 if not given
};

void add_master_options(CLI::App& command, MasterOptions& options);

/// PDO layout and cycle as asked for, and the nodes' identities, from the files of `robot`.
/// Throws std::runtime_error, one sentence, for a file that does not fit and for a rate whose period is not a
/// whole number of milliseconds: the drives are told it in milliseconds (60C2h).
[[nodiscard]] robot::RobotOptions load_robot_options(const MasterOptions& options,
                                                     const RobotDescription& robot);

/// The PDO layout of a robot that is called `name`, or in the file `name`; its own if empty. Throws
/// std::runtime_error.
[[nodiscard]] robot::PdoLayout load_layout(const std::string& name, const RobotDescription& robot);

/// Throws std::runtime_error when the layout's PDOs travel in frames other than those of a bus of the table.
void require_fit(const robot::RobotOptions& options, const DeviceTable& devices);

}  // namespace walkman::apps
