#include "emulator/nodes/drive/drive_parameters.h"

#include <limits>

namespace walkman::nodes {
namespace {

constexpr std::uint32_t kHandProduct = 4;

}  // namespace

DriveParameters hand_parameters(std::uint8_t node_id, std::string name, std::uint32_t serial,
                                double rated_torque) {
  DriveParameters p;
  p.node_id = node_id;
  p.name = std::move(name);
  p.product_code = kHandProduct;
  p.serial = serial;
  p.rated_torque = rated_torque;
  p.peak_torque = rated_torque;
  // No data sheet of the hand's motor and tendon is public; these are estimates that close the hand in under
  // two seconds.
  p.spring_constant = 8;
  p.motor_inertia = 0.02;
  p.position_bandwidth_hz = 10;
  p.lower = 0;
  p.upper = kHandTravel;
  p.max_velocity = 4;
  p.sync_divider = 1;
  p.interpolation_ms = 5;
  p.following_error_window = std::numeric_limits<double>::infinity();
  p.impossible_deflection = std::numeric_limits<double>::infinity();  // a tendon may go slack
  return p;
}

}  // namespace walkman::nodes
