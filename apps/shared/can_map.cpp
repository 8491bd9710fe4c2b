#include "apps/shared/can_map.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/shared/exit_code.h"
#include "drivers/camera/multisense/datagram.h"
#include "urdf/reader/nearest_name.h"

namespace walkman::apps {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
    end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
  }
  return parts;
}

CanAssignment parse_one(const std::string& item, const DeviceTable& devices) {
  const std::size_t equals = item.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == item.size()) {
    throw std::runtime_error(
        fmt::format("--can: '{}' does not name a bus and an interface, expected e.g. rarm=vcan1", item));
  }
  const std::string name = item.substr(0, equals);
  CanAssignment assignment;
  assignment.interface_name = item.substr(equals + 1);
  std::vector<std::string> names;
  for (const Bus& bus : devices.buses) names.push_back(bus.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw std::runtime_error(fmt::format("--can: there is no bus '{}', expected one of {}{}", name,
                                         fmt::join(names, ", "), did_you_mean(name, names)));
  }
  assignment.bus = static_cast<std::size_t>(found - names.begin());
  if (const auto problem = interface_name_problem(assignment.interface_name)) {
    throw std::runtime_error(
        fmt::format("--can: interface name '{}' {}", assignment.interface_name, *problem));
  }
  return assignment;
}

}  // namespace

void add_pacing_options(CLI::App& command, Pacing& pacing, const char* lockstep, const char* real_time) {
  CLI::Option* const first = command.add_flag_callback(
      "--lockstep", [&pacing] { pacing = Pacing::kLockstep; }, lockstep);
  CLI::Option* const second = command.add_flag_callback(
      "--realtime", [&pacing] { pacing = Pacing::kRealTime; }, real_time);
  first->excludes(second);
}

void add_camera_option(CLI::App& command, std::string& address) {
  command.add_option("--camera", address,
                     fmt::format("IPv4 address of the MultiSense, with :PORT if that is not {} (default: {})",
                                 multisense::kCommandPort, kDefaultCamera));
}

std::vector<CanAssignment> parse_can_map(const std::string& text, const DeviceTable& devices) {
  std::vector<CanAssignment> assignments;
  if (text.empty()) return assignments;
  for (const std::string& item : split(text, ',')) {
    const CanAssignment assignment = parse_one(item, devices);
    for (const CanAssignment& other : assignments) {
      if (other.bus == assignment.bus) {
        throw std::runtime_error(fmt::format("--can: bus {} is given twice, expected one interface per bus",
                                             devices.buses[assignment.bus].name));
      }
      if (other.interface_name == assignment.interface_name) {
        throw std::runtime_error(fmt::format(
            "--can: interface {} is given to buses {} and {}, expected one bus each",
            assignment.interface_name, devices.buses[other.bus].name, devices.buses[assignment.bus].name));
      }
    }
    assignments.push_back(assignment);
  }
  std::sort(assignments.begin(), assignments.end(),
            [](const CanAssignment& a, const CanAssignment& b) { return a.bus < b.bus; });
  return assignments;
}

std::unique_ptr<can::SocketCan> open_can(const std::string& interface_name,
                                         const can::SocketCanOptions& options) {
  try {
    return std::make_unique<can::SocketCan>(interface_name, options);
  } catch (const std::runtime_error& e) {
    throw EnvironmentError(e.what());
  }
}

}  // namespace walkman::apps
