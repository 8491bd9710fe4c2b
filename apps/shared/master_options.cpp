#include "apps/shared/master_options.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace walkman::apps {
namespace {

constexpr double kDefaultRate = 200;      // Hz
constexpr int kLongestPeriodMs = 20;      // 50 Hz; set-points farther apart are steps
constexpr const char* kShipped = "abcd";  // layouts of drivers/robot/pdo_layouts

std::filesystem::path layout_file(const std::string& layout, const std::filesystem::path& folder) {
  const bool letter = layout.size() == 1 && std::string(kShipped).find(layout) != std::string::npos;
  if (letter) return folder / "pdo_layouts" / ("layout_" + layout + ".yaml");
  std::error_code error;
  if (!std::filesystem::is_regular_file(layout, error)) {
    throw std::runtime_error(fmt::format("--layout {}: no such file, expected a, b, c, d or a file", layout));
  }
  return layout;
}

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
                     "PDO layout that is written to the nodes at boot: a, b, c, d or a file (default: a)");
  command.add_option("--rate", options.rate_hz,
                     "SYNCs a second; the period is a whole number of milliseconds (default: 200)");
}

robot::RobotOptions load_robot_options(const MasterOptions& options, const std::filesystem::path& data) {
  robot::RobotOptions out;
  out.cycle = period_of(options.rate_hz.value_or(kDefaultRate));
  out.layout = robot::load_pdo_layout(layout_file(options.layout, data / "drivers" / "robot"));
  out.identities = robot::load_identities(data / "drivers" / "robot" / "identities.yaml");
  return out;
}

void require_fit(const robot::RobotOptions& options, const DeviceTable& devices) {
  for (const Bus& bus : devices.buses) {
    if (bus.fd == options.layout.fd) continue;
    throw std::runtime_error(bus.fd ? fmt::format("bus {}: its PDOs travel in CAN FD frames, layout {} has "
                                                  "classical ones, expected a layout with can_fd: yes",
                                                  bus.name, options.layout.name)
                                    : fmt::format("bus {}: classical CAN, layout {} needs CAN FD, expected "
                                                  "fd: true in the device table",
                                                  bus.name, options.layout.name));
  }
}

}  // namespace walkman::apps
