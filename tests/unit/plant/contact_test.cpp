// Contacts of the row-space solver compared with Coulomb's law and with Bullet's own solver.

#include <cmath>
#include <memory>

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include "emulator/plant/contact/bullet_types.h"
#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/multibody.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/dynamics/world_objects.h"

namespace walkman::plant {
namespace {

constexpr double kStep = 1e-3;
constexpr double kGravity = 9.81;
constexpr double kFriction = 0.75 * 0.8;  // of the pair: floor times block

RobotModel box(const char* name, const Eigen::Vector3d& size, double mass) {
  RobotModel model;
  Link link;
  link.name = name;
  link.mass = mass;
  link.I_LLcm_L =
      mass / 12 *
      Eigen::Vector3d(size.y() * size.y() + size.z() * size.z(), size.x() * size.x() + size.z() * size.z(),
                      size.x() * size.x() + size.y() * size.y())
          .asDiagonal();
  LinkGeometry geometry;
  geometry.shape = BoxShape{size};
  link.collisions.push_back(geometry);
  model.links.push_back(link);
  return model;
}

/// A block of 2 kg and 10 cm on a floor whose top is z = 0.
struct BlockOnFloor {
  BlockOnFloor() {
    world.setGravity(btVector3(0, 0, -kGravity));
    world.getSolverInfo().m_numIterations = 50;
    world.getSolverInfo().m_linearSlop = 1e-5;
    FixedBody ground{"floor", "", box("floor", {4, 4, 1}, 0), Eigen::Isometry3d::Identity()};
    ground.model.links.front().surface.friction = 0.75;
    ground.X_WF.translation().z() = -0.5;
    floor = std::make_unique<StaticBody>(world, ground);
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    X_WB.translation().z() = 0.05;
    RobotModel model = box("block", {0.1, 0.1, 0.1}, 2);
    model.links.front().surface.friction = 0.8;
    block = std::make_unique<Multibody>(world, model, RigidTree(model, {}, {}), false, X_WB, kObjectGroup,
                                        kObjectGroup | kFixedGroup);
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds / kStep); ++i) world.stepSimulation(kStep, 0);
  }
  [[nodiscard]] double normal_force() {
    double sum = 0;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
      for (int k = 0; k < manifold->getNumContacts(); ++k)
        sum += manifold->getContactPoint(k).getAppliedImpulse();
    }
    return sum / kStep;
  }
  [[nodiscard]] Eigen::Vector3d position() const { return block->X_WL(0).translation(); }

  btDefaultCollisionConfiguration configuration;
  ContactDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  RowSpaceSolver solver;
  PlantWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::unique_ptr<StaticBody> floor;
  std::unique_ptr<Multibody> block;
};

/// The same block simulated entirely by Bullet.
Eigen::Vector3d where_bullets_block_stops(const btVector3& velocity) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, 0, -kGravity));
  world.getSolverInfo().m_numIterations = 50;
  world.getSolverInfo().m_linearSlop = 1e-5;
  btBoxShape ground(btVector3(2, 2, 0.5));
  btBoxShape cube(btVector3(0.05, 0.05, 0.05));
  btRigidBody floor(0, nullptr, &ground);
  floor.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, -0.5)));
  floor.setFriction(kFriction);
  world.addRigidBody(&floor);
  const double moment = 2.0 / 6 * 0.1 * 0.1;
  btMultiBody block(0, 2, btVector3(moment, moment, moment), false, false);
  block.finalizeMultiDof();
  block.setCanSleep(false);
  block.setLinearDamping(0);
  block.setAngularDamping(0);
  block.setBaseWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, 0.05)));
  btMultiBodyLinkCollider collider(&block, -1);
  collider.setCollisionShape(&cube);
  collider.setWorldTransform(block.getBaseWorldTransform());
  collider.setFriction(1);
  collider.setActivationState(DISABLE_DEACTIVATION);
  block.setBaseCollider(&collider);
  world.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  world.addMultiBody(&block);
  for (int i = 0; i < std::lround(0.5 / kStep); ++i) world.stepSimulation(kStep, 0);
  block.setBaseVel(velocity);
  for (int i = 0; i < std::lround(1 / kStep); ++i) world.stepSimulation(kStep, 0);
  Eigen::Vector3d place = from_bullet(block.getBasePos());

  world.removeMultiBody(&block);
  world.removeCollisionObject(&collider);
  world.removeRigidBody(&floor);
  return place;
}

TEST(Contact, CarriesTheWeightOfABlockAtRest) {
  BlockOnFloor scene;
  scene.run(1);
  EXPECT_NEAR(scene.normal_force(), 2 * kGravity, 1e-3 * 2 * kGravity);
  EXPECT_NEAR(scene.position().z(), 0.05, 2e-4);
  EXPECT_LT(scene.position().head<2>().norm(), 1e-6);
}

TEST(Contact, SlidingBlockStopsWhereCoulombSaysAndAlsoWithBulletsSolver) {
  const auto slide = [](const btVector3& velocity) {
    BlockOnFloor scene;
    scene.run(0.5);
    scene.block->bullet().setBaseVel(velocity);
    scene.run(1);
    return scene.position();
  };
  const double distance = 1 / (2 * kFriction * kGravity);  // from 1 m/s
  for (const btVector3& direction : {btVector3(1, 0, 0), btVector3(0.6, 0.8, 0)}) {
    const Eigen::Vector3d ours = slide(direction);
    EXPECT_NEAR(ours.head<2>().norm(), distance, 0.03 * distance);
    EXPECT_NEAR(ours.head<2>().normalized().dot(from_bullet(direction).head<2>()), 1,
                1e-3);  // a cone, not a pyramid
  }
  const Eigen::Vector3d ours = slide(btVector3(1, 0, 0));
  EXPECT_LT((ours - where_bullets_block_stops(btVector3(1, 0, 0))).norm(), 0.003);
}

TEST(Contact, HoldsBelowTheFrictionConeAndSlipsAboveIt) {
  for (const double share : {0.9, 1.1}) {
    BlockOnFloor scene;
    scene.run(0.5);
    const double before = scene.position().x();
    for (int i = 0; i < std::lround(0.5 / kStep); ++i) {
      scene.block->bullet().addBaseForce(btVector3(share * kFriction * 2 * kGravity, 0, 0));
      scene.world.stepSimulation(kStep, 0);
    }
    const double moved = scene.position().x() - before;
    if (share < 1) {
      EXPECT_LT(std::abs(moved), 2e-3) << "creep of velocity-level friction";
    } else {
      EXPECT_NEAR(moved, 0.5 * 0.1 * kFriction * kGravity * 0.25, 0.02);  // a = (1.1 − 1) μ g over 0.5 s
    }
  }
}

TEST(Contact, OfTwoBodiesThatCannotMoveDoesNothing) {
  BlockOnFloor scene;
  const RobotModel model = box("post", {0.1, 0.1, 0.1}, 2);
  Eigen::Isometry3d X_WP = Eigen::Isometry3d::Identity();
  X_WP.translation() = Eigen::Vector3d(0.5, 0, 0.0499);  // penetrates the floor by 0.1 mm
  const Multibody post(scene.world, model, RigidTree(model, {}, {}), true, X_WP, kObjectGroup,
                       kObjectGroup | kFixedGroup);
  scene.run(0.5);
  EXPECT_EQ(post.X_WL(0).translation(), X_WP.translation());
  EXPECT_NEAR(scene.normal_force(), 2 * kGravity, 1e-3 * 2 * kGravity);  // only the block's weight
}

TEST(PlantWorld, RefusesWhatItsSolverWouldPassOver) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  RowSpaceSolver solver;
  PlantWorld world(&dispatcher, &broadphase, &solver, &configuration);
  btSphereShape ball(0.1);
  btRigidBody moving(1, nullptr, &ball, btVector3(1, 1, 1));
  EXPECT_THROW(world.addRigidBody(&moving), std::logic_error);
  EXPECT_THROW(world.addRigidBody(&moving, kObjectGroup, kFixedGroup), std::logic_error);
  btPoint2PointConstraint pin(moving, btVector3(0, 0, 0));
  EXPECT_THROW(world.addConstraint(&pin, false), std::logic_error);
  EXPECT_THROW(world.addMultiBodyConstraint(nullptr), std::logic_error);
  EXPECT_EQ(world.getNumCollisionObjects() + world.getNumConstraints(), 0);
}

}  // namespace
}  // namespace walkman::plant
