#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/dynamics/world_objects.h"

namespace walkman::plant {

/// A solid, relative to its own centre.
using Shape = decltype(LinkGeometry::shape);

/// Returns an upright prism as a mesh, about its centre, with `sides` sides and corners at `radius`; with
/// four sides it is a box along the axes.
[[nodiscard]] MeshShape prism(int sides, double radius, double length);

/// Solids under gravity in a world made of the plant's own parts, with the plant's settings: its contacts,
/// its solver, its dynamics, 1 ms steps. Bodies that a test adds stay for the world's lifetime.
class ContactWorld {
 public:
  static constexpr double kStep = 1e-3;     // s
  static constexpr double kGravity = 9.81;  // m/s²

  ContactWorld();

  /// Adds a solid that never moves.
  void add_fixed(const Shape& shape, const Eigen::Isometry3d& X_WF, const Surface& surface);
  /// Adds a homogeneous solid that moves freely, at rest; returns its index.
  std::size_t add(const Shape& shape, double mass, const Eigen::Isometry3d& X_WB, const Surface& surface);

  void step() { world_.stepSimulation(kStep, 0); }
  void run(double seconds);

  /// Sets the force for the next step, at the centre of mass, N.
  void push(std::size_t body, const Eigen::Vector3d& force_W);
  void set_velocity(std::size_t body, const Eigen::Vector3d& v_WB);
  [[nodiscard]] Eigen::Isometry3d X_WB(std::size_t body) const { return bodies_[body]->X_WL(0); }
  [[nodiscard]] Eigen::Vector3d v_WB(std::size_t body) const;
  [[nodiscard]] Eigen::Vector3d w_WB(std::size_t body) const;
  [[nodiscard]] std::size_t count() const { return bodies_.size(); }
  /// Potential energy relative to z = 0 plus kinetic energy of one body, J.
  [[nodiscard]] double energy(std::size_t body) const;
  /// Number of contacts that carry load, as of the last step.
  [[nodiscard]] int contacts();

 private:
  btDefaultCollisionConfiguration configuration_;
  ContactDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  RowSpaceSolver solver_;
  PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<StaticBody>> fixed_;
  std::vector<std::unique_ptr<RobotModel>> models_;
  std::vector<std::unique_ptr<Multibody>> bodies_;
};

/// Returns a pose without rotation.
[[nodiscard]] inline Eigen::Isometry3d at(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

}  // namespace walkman::plant
