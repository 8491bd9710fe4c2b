#include "tests/unit/plant/hand_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>

namespace walkman::tests {
namespace {

/// Returns the part of a model below `root` as a separate model.
RobotModel part_of(const RobotModel& whole, const std::string& root) {
  RobotModel part;
  part.file = whole.file;
  std::vector<int> new_index(whole.links.size(), -1);
  const auto take = [&](int link) {
    new_index[static_cast<std::size_t>(link)] = static_cast<int>(part.links.size());
    part.links.push_back(whole.links[static_cast<std::size_t>(link)]);
  };
  take(whole.link_index(root));
  part.links.front().parent_joint = -1;
  bool more = true;
  while (more) {
    more = false;
    for (const Joint& joint : whole.joints) {
      const int parent = new_index[static_cast<std::size_t>(joint.parent_link)];
      if (parent < 0 || new_index[static_cast<std::size_t>(joint.child_link)] >= 0) continue;
      take(joint.child_link);
      part.links.back().parent_joint = static_cast<int>(part.joints.size());
      part.joints.push_back(joint);
      part.joints.back().parent_link = parent;
      part.joints.back().child_link = static_cast<int>(part.links.size()) - 1;
      more = true;
    }
  }
  return part;
}

RobotModel cylinder(const Grasp& grasp) {
  const double r = grasp.diameter / 2;
  const double across = grasp.mass * (3 * r * r + grasp.length * grasp.length) / 12;
  RobotModel model;
  Link link;
  link.name = "cylinder";
  link.mass = grasp.mass;
  link.I_LLcm_L = Eigen::Vector3d(grasp.mass * r * r / 2, across, across).asDiagonal();
  LinkGeometry geometry;
  geometry.shape = CylinderShape{r, grasp.length};
  geometry.X_LG.linear() =
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  link.collisions.push_back(geometry);
  model.links.push_back(link);
  return model;
}

}  // namespace

HandWorld::HandWorld(const Grasp& grasp)
    : hand_model_(part_of(load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf"),
                          std::string(1, grasp.side) + "SoftHandLink")),
      cylinder_model_(cylinder(grasp)) {
  using plant::kObjectGroup;
  using plant::kRobotGroup;
  const std::string synergy = grasp.side == 'R' ? "r_handj_synergy" : "l_handj_synergy";
  const double outwards = grasp.side == 'R' ? 1 : -1;  // out of the palm, along its link's y
  world_.setGravity(btVector3(0, 0, 0));
  world_.getSolverInfo().m_numIterations = 50;
  world_.getSolverInfo().m_linearSlop = 1e-5;
  Eigen::Isometry3d X_WR = Eigen::Isometry3d::Identity();
  X_WR.linear() =
      Eigen::AngleAxisd(-outwards * std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  cylinder_model_.links.front().surface.friction = grasp.friction;
  body_ =
      std::make_unique<plant::Multibody>(world_, hand_model_, plant::RigidTree(hand_model_, {}, {synergy}),
                                         true, X_WR, kRobotGroup, kObjectGroup);
  const std::string face = std::string(1, grasp.side) + "SoftHand";
  const auto found = std::find_if(hand_model_.links.begin(), hand_model_.links.end(),
                                  [&](const Link& link) { return link.name == face; });
  palm_face_ = static_cast<int>(found - hand_model_.links.begin());
  Eigen::Isometry3d X_PO = Eigen::Isometry3d::Identity();
  X_PO.translation() = Eigen::Vector3d(0, outwards * (grasp.diameter / 2 + 2e-4), 0);
  cylinder_ =
      std::make_unique<plant::Multibody>(world_, cylinder_model_, plant::RigidTree(cylinder_model_, {}, {}),
                                         false, body_->X_WL(palm_face_) * X_PO, kObjectGroup, kRobotGroup);
  actuator_ =
      plant::load_actuators(std::string(WALKMAN_URDF_DIR) + "/../emulator/plant/actuators").at("hand");
  hand_ =
      std::make_unique<plant::SoftHand>(hand_model_, *body_, synergy, actuator_, plant::SoftHandParameters{});
  hand_->reset();
  body_->update_poses();
  meter_ = std::make_unique<plant::SlipMeter>(*body_, 0, *cylinder_);
}

void HandWorld::step(double torque, const Eigen::Vector3d& f_W, const Eigen::Vector3d& t_W) {
  constexpr int kSubSteps = 4;
  for (int i = 0; i < kSubSteps; ++i) hand_->advance(torque, false, i * kStep / kSubSteps, kStep / kSubSteps);
  hand_->apply();
  cylinder_->bullet().addBaseForce(btVector3(f_W.x(), f_W.y(), f_W.z()));
  cylinder_->bullet().addBaseTorque(btVector3(t_W.x(), t_W.y(), t_W.z()));
  world_.stepSimulation(kStep, 0);
  meter_->update(dispatcher_);
}

void HandWorld::run(double seconds, double torque) {
  const int steps = static_cast<int>(std::lround(seconds / kStep));
  for (int i = 0; i < steps; ++i) step(torque);
}

template <typename Visit>
void HandWorld::for_each_contact(Visit visit) {
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      if (point.getAppliedImpulse() > 0) visit(*manifold, point);
    }
  }
}

double HandWorld::grip() {
  double sum = 0;
  for_each_contact([&](const btPersistentManifold&, const btManifoldPoint& point) {
    sum += point.getAppliedImpulse() / kStep;
  });
  return sum;
}

double HandWorld::squeeze() {
  // Force on the half away from the palm; in both hands the palm faces down, and world z is its normal.
  const double middle = cylinder_->X_WL(0).translation().z();
  double sum = 0;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    const auto* a = btMultiBodyLinkCollider::upcast(manifold->getBody0());
    const bool cylinder_is_a = a != nullptr && a->m_multiBody == &cylinder_->bullet();
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      if (point.getPositionWorldOnB().z() > middle) continue;
      const btVector3 on_a = point.m_normalWorldOnB * point.m_appliedImpulse +
                             point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                             point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
      sum += (cylinder_is_a ? on_a.z() : -on_a.z()) / kStep;
    }
  }
  return sum;
}

Eigen::Matrix<double, 6, 6> HandWorld::stiffness(bool tendon_sticks) {
  std::vector<int> fingers;  // joints
  for (std::size_t i = 0; i < hand_model_.joints.size(); ++i)
    if (hand_model_.joints[i].mimic) fingers.push_back(static_cast<int>(i));
  const auto n = static_cast<Eigen::Index>(fingers.size());
  const Eigen::Vector3d p_WC = cylinder_->X_WL(0).translation();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(6 + n, 6 + n);
  for_each_contact([&](const btPersistentManifold& manifold, const btManifoldPoint& point) {
    const auto* a = btMultiBodyLinkCollider::upcast(manifold.getBody0());
    const auto* b = btMultiBodyLinkCollider::upcast(manifold.getBody1());
    const int group = (a->m_multiBody == &body_->bullet() ? a : b)->m_link + 1;
    const btVector3 middle = (point.getPositionWorldOnA() + point.getPositionWorldOnB()) / 2;
    const Eigen::Vector3d p_W(middle.x(), middle.y(), middle.z());
    const Eigen::Vector3d normal_W(point.m_normalWorldOnB.x(), point.m_normalWorldOnB.y(),
                                   point.m_normalWorldOnB.z());
    // Of the cylinder relative to the hand.
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 6 + n);
    J.leftCols<3>().setIdentity();
    for (int k = 0; k < 3; ++k) J.col(3 + k) = Eigen::Vector3d::Unit(k).cross(p_W - p_WC);
    int link = body_->tree().groups()[static_cast<std::size_t>(group)].root_link;
    const double pad = hand_model_.links[static_cast<std::size_t>(link)].surface.stiffness;
    for (int joint = hand_model_.links[static_cast<std::size_t>(link)].parent_joint; joint >= 0;
         joint = hand_model_.links[static_cast<std::size_t>(link)].parent_joint) {
      const auto found = std::find(fingers.begin(), fingers.end(), joint);
      if (found != fingers.end()) {
        const Eigen::Isometry3d X_WF = body_->X_WL(link);
        const Eigen::Vector3d axis_W =
            X_WF.linear() * hand_model_.joints[static_cast<std::size_t>(joint)].axis;
        J.col(6 + (found - fingers.begin())) = -axis_W.cross(p_W - X_WF.translation());
      }
      link = hand_model_.joints[static_cast<std::size_t>(joint)].parent_link;
    }
    const Eigen::Matrix3d across = normal_W * normal_W.transpose();
    constexpr double kMindlin = 2.0 / 3;  // 2 (1 − ν) / (2 − ν) for an incompressible pad, 1949
    K += pad * J.transpose() * (across + kMindlin * (Eigen::Matrix3d::Identity() - across)) * J;
  });
  const plant::SoftHandParameters parameters;
  Eigen::VectorXd lever(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int joint = fingers[static_cast<std::size_t>(i)];
    const std::string& name = hand_model_.joints[static_cast<std::size_t>(joint)].name;
    const bool distal = name.ends_with("Flexion2");
    const bool thumb = name.find("Thumb") != std::string::npos;
    lever(i) = (distal ? parameters.distal_radius : parameters.proximal_radius) *
               (thumb ? parameters.thumb_factor : 1);
    K(6 + i, 6 + i) +=
        parameters.return_stiffness + (tendon_sticks ? lever(i) * lever(i) * parameters.tendon_stiffness : 0);
  }
  const double to_motor = actuator_.spring_constant / std::pow(parameters.pulley_radius, 2);  // N/m
  K.bottomRightCorner(n, n) += to_motor * lever * lever.transpose();
  return K.topLeftCorner<6, 6>() -
         K.topRightCorner(6, n) * K.bottomRightCorner(n, n).ldlt().solve(K.bottomLeftCorner(n, 6));
}

std::set<std::string> HandWorld::touching() {
  std::set<std::string> names;
  for_each_contact([&](const btPersistentManifold& manifold, const btManifoldPoint&) {
    for (const btCollisionObject* object : {manifold.getBody0(), manifold.getBody1()}) {
      const auto* collider = btMultiBodyLinkCollider::upcast(object);
      if (collider == nullptr || collider->m_multiBody != &body_->bullet()) continue;
      const auto group = static_cast<std::size_t>(collider->m_link) + 1;
      names.insert(hand_model_.links[static_cast<std::size_t>(body_->tree().groups()[group].root_link)].name);
    }
  });
  return names;
}

Eigen::Isometry3d HandWorld::X_PO() const { return body_->X_WL(palm_face_).inverse() * cylinder_->X_WL(0); }

}  // namespace walkman::tests
