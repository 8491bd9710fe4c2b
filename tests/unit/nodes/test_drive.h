#pragma once

#include "emulator/nodes/drive/drive_node.h"

namespace walkman::nodes {

/// A shoulder-like drive with node-ID 5, rated 100 N·m.
inline DriveParameters test_drive(std::uint8_t node_id = 5) {
  DriveParameters p;
  p.node_id = node_id;
  p.name = "RShLat drive";
  p.serial = 0x1000U + node_id;
  p.rated_torque = 100;
  p.peak_torque = 150;
  p.spring_constant = 1300;
  p.motor_inertia = 0.3;
  p.lower = -2;
  p.upper = 2;
  p.max_velocity = 6;
  return p;
}

}  // namespace walkman::nodes
