// Mobilities of contact points from the factorised joint-space inertia, compared with Bullet's
// articulated-body recursion over the whole tree.

#include "emulator/plant/dynamics/joint_space_inertia.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include "emulator/plant/dynamics/constraint_rows.h"
#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {
namespace {

class OfTheRobot : public ::testing::TestWithParam<bool> {
 protected:
  OfTheRobot() {
    world_.setGravity(btVector3(0, 0, 0));
    btMultiBody& body = body_.bullet();
    for (int i = 0; i < body.getNumLinks(); ++i) {
      if (body.getLink(i).m_dofCount > 0) body.setJointPos(i, uniform(random_));
    }
    body.setBaseWorldTransform(
        btTransform(btQuaternion(btVector3(0.6, -0.3, 0.74).normalized(), 0.8), btVector3(3, -2, 1)));
    body_.update_poses();
    // Leaves the data from which the recursion for impulses starts.
    body.computeAccelerationsArticulatedBodyAlgorithmMultiDof(1e-3, scratch_r_, scratch_v_, scratch_m_, false,
                                                              false, false);
    inertia_.update(body);
  }

  struct Push {
    int link;
    btVector3 p_W, direction;
  };
  Push random_push() {
    btMultiBody& body = body_.bullet();
    const int link = std::uniform_int_distribution<int>(-1, body.getNumLinks() - 1)(random_);
    const btVector3 origin =
        link < 0 ? body.getBasePos() : body.getLink(link).m_cachedWorldTransform.getOrigin();
    const btVector3 offset(uniform(random_), uniform(random_), uniform(random_));
    const btVector3 direction(uniform(random_), uniform(random_), uniform(random_));
    return {link, origin + 0.2 * offset, direction.normalized()};
  }
  std::vector<double> bullets_jacobian(const Push& push) {
    std::vector<double> jacobian(velocities(), 0);
    body_.bullet().fillContactJacobianMultiDof(push.link, push.p_W, push.direction, jacobian.data(),
                                               scratch_r_, scratch_v_, scratch_m_);
    return jacobian;
  }
  std::vector<double> bullets_response(const Push& push) {
    std::vector<double> change(velocities(), 0);
    const std::vector<double> jacobian = bullets_jacobian(push);
    body_.bullet().calcAccelerationDeltasMultiDof(jacobian.data(), change.data(), scratch_r_, scratch_v_);
    return change;
  }
  std::vector<double> whitened(const Push& push) {
    std::vector<double> row(inertia_.path(push.link).size());
    inertia_.point_jacobian(push.link, push.p_W, push.direction, row.data());
    inertia_.whiten(push.link, row.data());
    return row;
  }
  /// Our change of the velocity vector for a unit impulse.
  std::vector<double> response(const Push& push) {
    std::vector<double> change(velocities(), 0);
    const std::vector<double> row = whitened(push);
    for (std::size_t k = 0; k < row.size(); ++k)
      change[static_cast<std::size_t>(inertia_.path(push.link)[k])] = row[k];
    inertia_.unwhiten(change);
    return change;
  }
  [[nodiscard]] std::size_t velocities() const {
    return 6 + static_cast<std::size_t>(body_.bullet().getNumDofs());
  }

  std::mt19937_64 random_{20};
  std::uniform_real_distribution<double> uniform{-1, 1};
  RobotModel model_ = load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf");
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btMultiBodyConstraintSolver solver_;
  btMultiBodyDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  const bool fixed_base_ = GetParam();
  Multibody body_{world_, model_, RigidTree(model_, {}, {}), fixed_base_, Eigen::Isometry3d::Identity(),
                  0,      0};
  JointSpaceInertia inertia_;
  btAlignedObjectArray<btScalar> scratch_r_;
  btAlignedObjectArray<btVector3> scratch_v_;
  btAlignedObjectArray<btMatrix3x3> scratch_m_;
};

TEST_P(OfTheRobot, JacobiansAreBullets) {
  for (int i = 0; i < 200; ++i) {
    const Push push = random_push();
    std::vector<double> ours(inertia_.path(push.link).size());
    inertia_.point_jacobian(push.link, push.p_W, push.direction, ours.data());
    std::vector<double> theirs = bullets_jacobian(push);
    for (std::size_t k = 0; k < ours.size(); ++k) {
      double& entry = theirs[static_cast<std::size_t>(inertia_.path(push.link)[k])];
      EXPECT_NEAR(ours[k], entry, 1e-12);
      entry = 0;
    }
    // Nothing else moves the link; Bullet fills the base's six entries for a fixed base, too, and leaves them
    // unused.
    for (std::size_t v = fixed_base_ ? 6 : 0; v < theirs.size(); ++v) EXPECT_EQ(theirs[v], 0);
  }
}

TEST_P(OfTheRobot, ResponsesToImpulsesAreBullets) {
  for (int i = 0; i < 200; ++i) {
    const Push push = random_push();
    const std::vector<double> ours = response(push);
    const std::vector<double> theirs = bullets_response(push);
    double largest = 0;
    for (const double v : theirs) largest = std::max(largest, std::abs(v));
    for (std::size_t v = 0; v < ours.size(); ++v) EXPECT_NEAR(ours[v], theirs[v], 1e-10 * (1 + largest));
  }
}

TEST_P(OfTheRobot, MobilityBetweenTwoPointsIsBullets) {
  int coupled = 0;
  for (int i = 0; i < 500; ++i) {
    const Push a = random_push();
    const Push b = random_push();
    const std::vector<double> row_a = whitened(a);
    const std::vector<double> row_b = whitened(b);
    const auto path_a = inertia_.path(a.link);
    const auto path_b = inertia_.path(b.link);
    double ours = 0;
    for (std::size_t k = 0; k < std::min(row_a.size(), row_b.size()) && path_a[k] == path_b[k]; ++k)
      ours += row_a[k] * row_b[k];
    const std::vector<double> jacobian = bullets_jacobian(a);
    const std::vector<double> change = bullets_response(b);
    double theirs = 0;
    for (std::size_t v = 0; v < change.size(); ++v) theirs += jacobian[v] * change[v];
    EXPECT_NEAR(ours, theirs, 1e-10 * (1 + std::abs(theirs)));
    if (theirs != 0) ++coupled;
  }
  EXPECT_GT(coupled, 100);
}

TEST_P(OfTheRobot, AContactOfTwoOfItsOwnLinksIsBullets) {
  btMultiBody& body = body_.bullet();
  const int hand = body_.bullet_link(model_.joint_index("RWrj2"));
  const int thigh = body_.bullet_link(model_.joint_index("LHipYaw"));
  btPersistentManifold manifold(body.getLink(hand).m_collider, body.getLink(thigh).m_collider, 0, 0.02, 1);
  const btVector3 p_W = body.getLink(hand).m_cachedWorldTransform.getOrigin();
  btManifoldPoint touching(btVector3(0, 0, 0), btVector3(0, 0, 0), btVector3(0.36, 0.48, 0.8), -1e-4);
  touching.m_positionWorldOnA = p_W;
  touching.m_positionWorldOnB = p_W + btVector3(0, 0, 1e-4);
  touching.m_combinedFriction = 0.5;
  manifold.addManifoldPoint(touching);
  for (int i = 0; i < body.getNumLinks(); ++i) {
    if (body.getLink(i).m_dofCount > 0) body.setJointVel(i, uniform(random_));
  }
  const std::vector<double> before(body.getVelocityVector(), body.getVelocityVector() + velocities());

  btContactSolverInfo info;
  info.m_timeStep = 1e-3;
  ConstraintRows rows;
  btPersistentManifold* const manifolds[] = {&manifold};
  const KnownBody known[] = {{&body, &inertia_}};
  rows.build(known, {}, manifolds, info);
  ASSERT_EQ(rows.rows().size(), 3U);
  Eigen::MatrixXd W;
  rows.delassus(W);

  const btManifoldPoint& point = manifold.getContactPoint(0);
  std::vector<std::vector<double>> jacobians, responses;
  for (const btVector3& direction :
       {point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2}) {
    std::vector<double> jacobian = bullets_jacobian({hand, point.m_positionWorldOnA, direction});
    const std::vector<double> other = bullets_jacobian({thigh, point.m_positionWorldOnB, -direction});
    for (std::size_t v = 0; v < jacobian.size(); ++v) jacobian[v] += other[v];
    std::vector<double> change(velocities(), 0);
    body.calcAccelerationDeltasMultiDof(jacobian.data(), change.data(), scratch_r_, scratch_v_);
    jacobians.push_back(jacobian);
    responses.push_back(change);
  }
  const auto dot = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  const Eigen::Vector3d impulses(3, -0.7, 1.1);
  rows.apply(impulses, Eigen::Vector3d::Zero(), info.m_timeStep);
  std::vector<double> expected = before;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(W(static_cast<int>(i), static_cast<int>(k)), dot(jacobians[i], responses[k]),
                  1e-9 * (1 + std::abs(dot(jacobians[i], responses[i]))));
    }
    EXPECT_NEAR(rows.rows()[i].velocity, dot(jacobians[i], before), 1e-12);
    for (std::size_t v = 0; v < expected.size(); ++v)
      expected[v] += impulses[static_cast<int>(i)] * responses[i][v];
  }
  for (std::size_t v = fixed_base_ ? 6 : 0; v < expected.size(); ++v)
    EXPECT_NEAR(body.getVelocityVector()[v], expected[v], 1e-9 * (1 + std::abs(expected[v])));
}

INSTANTIATE_TEST_SUITE_P(Base, OfTheRobot, ::testing::Bool(),
                         [](const auto& base) { return base.param ? "Fixed" : "Free"; });

}  // namespace
}  // namespace walkman::plant
