#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <Eigen/Core>

#include "emulator/plant/dynamics/joint_space_inertia.h"
#include "emulator/plant/dynamics/joint_stop.h"

namespace walkman::plant {

/// A group of rows between the same two links: a joint's stop, or the contacts of a manifold.
struct RowBlock {
  struct Side {
    int tree = -1;  // −1: does not move
    int link = -1;
    std::size_t first_entry = 0;  // of its rows, one after the other, in the whitened Jacobian
    int length = 0;               // of a row: the link's path
  };
  Side a, b;
  int first_row = 0;
  int row_count = 0;
};

/// One inequality or friction row, in impulses (N·s or N·m·s) and velocities (m/s or rad/s) along it.
struct Row {
  double velocity;  // before the solve
  double target;    // what the impulse shall make of it
  double softness;  // velocity the row gives way by per impulse: Bullet's CFM over the step
};

/// A contact: three rows, along its normal and two tangents.
constexpr int kContactRows = 3;
struct ContactRow {
  btManifoldPoint* point;
  double friction;
};

/// Rows of a step: joints' stops first, then three of each contact. Reads manifolds of multibodies with each
/// other and with what does not move; no other rigid body may move in the world.
class ConstraintRows {
 public:
  void build(std::span<const JointStop> stops, std::span<btPersistentManifold* const> manifolds,
             const btContactSolverInfo& info);

  [[nodiscard]] int stop_count() const { return stop_count_; }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] const std::vector<ContactRow>& contacts() const { return contacts_; }

  /// W = J H⁻¹ Jᵀ: velocity along each row by a unit impulse along each other.
  void delassus(Eigen::MatrixXd& W) const;
  /// Hands the impulses to the multibodies: their change of velocity, and the forces of contacts as
  /// constraint forces at the links; contact points remember theirs.
  void apply(const Eigen::VectorXd& impulses, double dt);

 private:
  struct Tree {
    btMultiBody* body = nullptr;
    bool current = false;
    JointSpaceInertia inertia;
    std::vector<double> change;
  };

  int tree_of(btMultiBody* body);
  [[nodiscard]] RowBlock::Side side(int tree, int link, int rows);
  void add_stop(const JointStop& stop, const btContactSolverInfo& info);
  void add_manifold(btPersistentManifold& manifold, const btContactSolverInfo& info);
  void add_contact(const RowBlock& block, btManifoldPoint& point, const btContactSolverInfo& info);
  double add_direction(const RowBlock& block, const btManifoldPoint& point, const btVector3& direction);
  double whiten(const RowBlock::Side& side, int row, const btVector3& p_W, const btVector3& direction);
  void couple(const RowBlock& rows, const RowBlock::Side& s, const RowBlock& columns, const RowBlock::Side& t,
              Eigen::MatrixXd& W) const;
  void push_links(const RowBlock& block, const btManifoldPoint& point, const btVector3& force) const;

  std::vector<Tree> trees_;
  std::vector<RowBlock> blocks_;
  std::vector<Row> rows_;
  std::vector<ContactRow> contacts_;
  std::vector<double> whitened_;  // L⁻ᵀ Jᵀ of each row and side
  int stop_count_ = 0;
};

}  // namespace walkman::plant
