#include "apps/shared/master_options.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace walkman::apps {
namespace {

constexpr double kDefaultRate = 200;  // Hz
constexpr int kLongestPeriodMs = 20;  // 50 Hz; set-points farther apart are steps
Time period_of(double rate_hz) {
  const double milliseconds = 1000 / rate_hz;
  const double whole = std::round(milliseconds);
  if (!(rate_hz > 0) || !(whole >= 1 && whole <= kLongestPeriodMs) || std::abs(milliseconds - whole) > 1e-6) {
    throw std::runtime_error(
        fmt::format("--rate {:g}: a cycle of {:.4g} ms, expected a rate in Hz with a period of 1 to {} whole "
                    "milliseconds, e.g. 100, 125, 200, 250, 500 or 1000",
                    rate_hz, milliseconds, kLongestPeriodMs));
  }
  return std::chrono::milliseconds(static_cast<int>(whole));
}

}  // namespace

void add_master_options(CLI::App& command, MasterOptions& options) {
  command.add_option("--layout", options.layout,
                     "PDO layout that is written to the nodes at boot: a, b, c, d, e or a file (default: the "
                     "robot's own, a)");
  command.add_option("--rate", options.rate_hz,
                     "SYNCs per second; the period is a whole number of milliseconds (default: 200)");
}

robot::PdoLayout load_layout(const std::string& name, const RobotDescription& robot) {
  const std::string& wanted = name.empty() ? robot.pdo_layout : name;
  std::vector<std::string> names;
  for (const RobotDescription::PdoLayoutFile& layout : robot.pdo_layouts) {
    if (layout.name == wanted) return robot::load_pdo_layout(layout.file);
    names.push_back(layout.name);
  }
  std::error_code error;
  if (!std::filesystem::exists(wanted, error)) {
    throw std::runtime_error(
        fmt::format("--layout {}: no such file, expected {} or a file", wanted, fmt::join(names, ", ")));
  }
  return robot::load_pdo_layout(wanted);
}

robot::RobotOptions load_robot_options(const MasterOptions& options, const RobotDescription& robot) {
  robot::RobotOptions out;
  out.cycle = period_of(options.rate_hz.value_or(kDefaultRate));
  out.layout = load_layout(options.layout, robot);
  out.identities = robot::load_identities(robot.identities);
  return out;
}

void require_fit(const robot::PdoLayout& layout, const DeviceTable& devices) {
  for (const Bus& bus : devices.buses) {
    if (bus.fd == layout.fd) continue;
    throw std::runtime_error(bus.fd ? fmt::format("bus {}: its PDOs travel in CAN FD frames, layout {} has "
                                                  "classical ones, expected a layout with can_fd: yes",
                                                  bus.name, layout.name)
                                    : fmt::format("bus {}: classical CAN, layout {} needs CAN FD, expected "
                                                  "--fd, or fd: true in the device table",
                                                  bus.name, layout.name));
  }
}

}  // namespace walkman::apps
