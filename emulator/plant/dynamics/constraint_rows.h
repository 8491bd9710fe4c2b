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
    std::size_t first_entry = 0;  // of its rows, stored consecutively in the whitened Jacobian
    int length = 0;               // of a row: that of the link's path
  };
  Side a, b;
  int first_row = 0;
  int row_count = 0;
  int first_contact = -1;  // index of its first contact; −1: has none
};

/// One inequality or friction row, in impulses (N·s or N·m·s) and velocities (m/s or rad/s) along it.
struct Row {
  double velocity;   // before the solve
  double target;     // velocity that the impulse should produce
  double softness;   // velocity by which the row yields per unit impulse: Bullet's CFM over the step
  double start = 0;  // impulse from which the sweeps start
};

/// A contact: three rows, along its normal and two tangents.
constexpr int kContactRows = 3;
struct ContactRow {
  btManifoldPoint* point;
  const btMatrix3x3* R_WA;  // of the body in whose frame its Stick is expressed
  double friction;
  double give;  // tangential compliance of the surfaces, m/N; 0: rigid
};

/// A contact that resists rolling or turning: three rows, about its normal and its two tangents.
struct TurnRow {
  int row;                   // the first of the three
  int contact;               // index
  double spinning, rolling;  // lever arms of the normal force, m
};

/// A moving multibody and its inertia, factorised at its poses.
struct KnownBody {
  btMultiBody* body;
  const JointSpaceInertia* inertia;
};

/// Rows of a step: joint stops first, then three for each contact, then three for each contact that resists
/// turning. Reads manifolds of multibodies with each other and with static bodies; no other rigid body in the
/// world may move.
class ConstraintRows {
 public:
  /// `bodies`: all multibodies that move.
  void build(std::span<const KnownBody> bodies, std::span<const JointStop> stops,
             std::span<btPersistentManifold* const> manifolds, const btContactSolverInfo& info);

  [[nodiscard]] int stop_count() const { return stop_count_; }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] const std::vector<ContactRow>& contacts() const { return contacts_; }
  [[nodiscard]] const std::vector<TurnRow>& turns() const { return turns_; }

  /// Computes W = J H⁻¹ Jᵀ: the velocity along each row due to a unit impulse along each other row.
  void delassus(Eigen::MatrixXd& W) const;
  /// Applies the impulses to the multibodies: changes their velocities and adds the contact forces as
  /// constraint forces at the links. Contact points store their impulses, and how far they have shifted if
  /// their surfaces move with `velocities` along the rows.
  void apply(const Eigen::VectorXd& impulses, const Eigen::VectorXd& velocities, double dt);

 private:
  struct Tree {
    btMultiBody* body = nullptr;
    const JointSpaceInertia* inertia = nullptr;
    bool touched = false;
    std::vector<double> change;
  };

  int tree_of(const btMultiBody* body);
  [[nodiscard]] RowBlock::Side side(int tree, int link, int rows);
  void add_stop(const JointStop& stop, const btContactSolverInfo& info);
  [[nodiscard]] RowBlock block_between(const btPersistentManifold& manifold, int rows);
  void add_manifold(btPersistentManifold& manifold, const btContactSolverInfo& info);
  void add_contact(const RowBlock& block, const btMatrix3x3& R_WA, btManifoldPoint& point,
                   const btContactSolverInfo& info);
  void add_turns(btPersistentManifold& manifold, int first_contact);
  void shift(const ContactRow& contact, int row, const Eigen::VectorXd& impulses,
             const Eigen::VectorXd& velocities, double dt) const;
  double add_direction(const RowBlock& block, const btManifoldPoint& point, const btVector3& direction);
  double whiten(const RowBlock::Side& side, int row, const btVector3& p_W, const btVector3& direction);
  /// Adds the coupling between these two sides to a block of W, or overwrites the block if it is the `first`.
  /// Returns false if there is none.
  bool couple(const RowBlock& rows, const RowBlock::Side& s, const RowBlock& columns, const RowBlock::Side& t,
              bool first, Eigen::MatrixXd& W) const;
  double whiten(const RowBlock::Side& side, double* entries) const;
  [[nodiscard]] double* entries_of(const RowBlock::Side& side, int row);
  double whiten_turn(const RowBlock::Side& side, int row, const btVector3& axis);
  void push_links(const RowBlock& block, const btManifoldPoint& point, const btVector3& force) const;
  void twist_links(const TurnRow& turn, const btVector3& torque) const;

  std::vector<Tree> trees_;
  std::vector<RowBlock> blocks_;
  std::vector<Row> rows_;
  std::vector<ContactRow> contacts_;
  std::vector<TurnRow> turns_;
  std::vector<double> whitened_;  // L⁻ᵀ Jᵀ of each row and side
  int stop_count_ = 0;
};

}  // namespace walkman::plant
