#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// The command line's options for the master: `--layout` and `--rate`.
struct MasterOptions {
  std::string layout;             ///< name of one of the robot's layouts, or a file; the robot's own if empty
  std::optional<double> rate_hz;  ///< of SYNC; 200 if not given
};

void add_master_options(CLI::App& command, MasterOptions& options);

/// The requested PDO layout and cycle, and the nodes' identities, from the files of `robot`.
/// Throws std::runtime_error, one sentence, for an invalid file and for a rate whose period is not a whole
/// number of milliseconds: the drives receive it in milliseconds (60C2h).
[[nodiscard]] robot::RobotOptions load_robot_options(const MasterOptions& options,
                                                     const RobotDescription& robot);

/// The robot's PDO layout called `name`, or the one in the file `name`; the robot's own if empty. Throws
/// std::runtime_error.
[[nodiscard]] robot::PdoLayout load_layout(const std::string& name, const RobotDescription& robot);

/// Throws std::runtime_error if the layout's PDOs need another kind of frame than that of a bus of the table.
void require_fit(const robot::PdoLayout& layout, const DeviceTable& devices);

}  // namespace walkman::apps
