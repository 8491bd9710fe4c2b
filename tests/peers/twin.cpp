#include "tests/peers/twin.h"

#include <algorithm>
#include <cmath>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::peers {
namespace {

// The friction of a pair of surfaces is the product of both in Bullet, the larger of both in MuJoCo.
constexpr double kRobotFriction = 0.8;  // of the soles
constexpr double kGroundFriction = 0.75;

bool has_drive(const DeviceTable& devices, const std::string& joint) {
  return std::any_of(devices.buses.begin(), devices.buses.end(), [&](const Bus& bus) {
    return std::any_of(bus.devices.begin(), bus.devices.end(), [&](const Device& device) {
      return device.kind == DeviceKind::kJointDrive && device.name == joint;
    });
  });
}

/// The robot's rigid groups as in the plant: fingers do not move, and a sensor that carries a body has a
/// separate rigid joint.
plant::RigidTree rigid_tree(const RobotModel& model, const DeviceTable& devices,
                            const std::vector<std::string>& sensors) {
  std::vector<std::string> frozen, cuts;
  for (const Joint& joint : model.joints) {
    if (joint.type != JointType::kFixed && !has_drive(devices, joint.name)) frozen.push_back(joint.name);
    const std::string& child = model.links[static_cast<std::size_t>(joint.child_link)].name;
    const bool senses = std::find(sensors.begin(), sensors.end(), child) != sensors.end();
    const bool carries = std::any_of(model.joints.begin(), model.joints.end(), [&](const Joint& other) {
      return other.parent_link == joint.child_link;
    });
    if (senses && carries) cuts.push_back(joint.name);
  }
  return plant::RigidTree(model, cuts, frozen);
}

FixedBody ground_body() {
  FixedBody ground;
  ground.name = "ground";
  Link link;
  link.name = "ground";
  LinkGeometry slab{Eigen::Isometry3d::Identity(), BoxShape{{10, 10, 0.1}}, "slab"};
  slab.X_LG.translation().z() = -0.05;
  link.collisions.push_back(slab);
  link.surface.friction = kGroundFriction;
  ground.model.links.push_back(link);
  return ground;
}

}  // namespace

Twin::Twin(const RobotModel& model, const DeviceTable& devices, const TwinOptions& options)
    : fixed_base_(options.fixed_base) {
  world_.setGravity(btVector3(0, 0, -kGravity));
  if (options.mid_step_velocities) world_.use_mid_step_velocities();
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = 50;
  info.m_erp2 = 0.2;
  info.m_globalCfm = 0;
  info.m_linearSlop = 1e-5;
  if (options.ground) {
    ground_ = std::make_unique<plant::StaticBody>(world_, ground_body());
  }
  body_ = std::make_unique<plant::Multibody>(world_, model, rigid_tree(model, devices, options.sensors),
                                             options.fixed_base, options.X_WR, plant::kRobotGroup,
                                             options.ground ? plant::kFixedGroup : 0);
  const plant::RigidTree& tree = body_->tree();

  MjcfOptions mjcf_options;
  mjcf_options.fixed_base = options.fixed_base;
  mjcf_options.X_WR = options.X_WR;
  mjcf_options.step = kStep;
  mjcf_options.gravity = kGravity;
  mjcf_options.ground = options.ground;
  mjcf_options.friction = kRobotFriction * kGroundFriction;
  for (const std::string& sensor : options.sensors) {
    const int link = model.link_index(sensor);
    const int group = tree.group_of(link);
    probes_.push_back(std::make_unique<plant::WrenchProbe>(*body_, link, group));
    world_.add_probe(*probes_.back());
    mjcf_options.sensors.push_back({sensor, link, group});
  }
  mujoco_ = std::make_unique<MujocoWorld>(mjcf(model, tree, mjcf_options));
  for (const std::string& sensor : options.sensors) {
    force_address_.push_back(mujoco_->sensor_address(sensor + "_force"));
    torque_address_.push_back(mujoco_->sensor_address(sensor + "_torque"));
  }

  for (const plant::RigidBodyGroup& group : tree.groups()) {
    if (!group.moves) continue;
    const std::string& name = model.joints[static_cast<std::size_t>(group.joint)].name;
    joints_.push_back(group.joint);
    bullet_link_.push_back(body_->bullet_link(group.joint));
    q_address_.push_back(mujoco_->position_address(name));
    v_address_.push_back(mujoco_->velocity_address(name));
    const auto found = options.posture.find(name);
    first_position_.push_back(found == options.posture.end() ? 0 : found->second);
    body_->bullet().setJointPos(bullet_link_.back(), first_position_.back());
    mujoco_->data->qpos[q_address_.back()] = first_position_.back();
  }
  laws_.resize(joints_.size());
  body_->update_poses();
}

void Twin::hold_posture(const RobotModel& model, const DeviceTable& devices, double amplitude) {
  const std::map<std::string, double> stiffness{{"big", 4000}, {"medium", 3000}, {"medium2", 1300}};
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    laws_[i] = {500, 2, amplitude};
    for (const Bus& bus : devices.buses) {
      for (const Device& device : bus.devices) {
        const auto found = stiffness.find(device.actuator);
        if (device.name != model.joints[static_cast<std::size_t>(joints_[i])].name) continue;
        if (found != stiffness.end()) laws_[i] = {found->second, 0.004 * found->second, amplitude};
      }
    }
  }
}

double Twin::torque(std::size_t joint, double q, double v, long step) const {
  const JointLaw& law = laws_[joint];
  return law.stiffness * (first_position_[joint] - q) - law.damping * v +
         law.amplitude * std::sin(7 * kStep * static_cast<double>(step) + static_cast<double>(joint));
}

void Twin::step_bullet() {
  btMultiBody& body = body_->bullet();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const int link = bullet_link_[i];
    body.addJointTorque(link, torque(i, body.getJointPos(link), body.getJointVel(link), bullet_steps_));
  }
  world_.stepSimulation(kStep, 0);
  ++bullet_steps_;
}

void Twin::step_mujoco() {
  mjData& data = *mujoco_->data;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    data.qfrc_applied[v_address_[i]] =
        torque(i, data.qpos[q_address_[i]], data.qvel[v_address_[i]], mujoco_steps_);
  }
  mj_step(mujoco_->model.get(), &data);
  ++mujoco_steps_;
}

RobotState Twin::bullet_state() const {
  const btMultiBody& body = body_->bullet();
  RobotState state;
  for (const int link : bullet_link_) {
    state.q.push_back(body.getJointPos(link));
    state.v.push_back(body.getJointVel(link));
  }
  state.p_WBcm = plant::from_bullet(body.getBasePos());
  state.v_WBcm = plant::from_bullet(body.getBaseVel());
  state.w_WB = plant::from_bullet(body.getBaseOmega());
  return state;
}

RobotState Twin::mujoco_state() const {
  const mjData& data = *mujoco_->data;
  RobotState state;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    state.q.push_back(data.qpos[q_address_[i]]);
    state.v.push_back(data.qvel[v_address_[i]]);
  }
  if (fixed_base_) {
    state.p_WBcm = plant::from_bullet(body_->bullet().getBasePos());
    return state;
  }
  const auto vector_at = [](const mjtNum* v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
  const Eigen::Quaterniond R_WB(data.qpos[3], data.qpos[4], data.qpos[5], data.qpos[6]);
  state.p_WBcm = vector_at(data.qpos);
  state.v_WBcm = vector_at(data.qvel);
  state.w_WB = R_WB * vector_at(data.qvel + 3);  // MuJoCo gives it in the body's own axes
  return state;
}

Wrench Twin::mujoco_wrench(std::size_t sensor) const {
  const mjtNum* readings = mujoco_->data->sensordata;
  const mjtNum* force = readings + force_address_[sensor];
  const mjtNum* moment = readings + torque_address_[sensor];
  Wrench wrench;
  // MuJoCo gives what the carrying body exerts; the plant's sensors read the load on it.
  wrench.force = -Eigen::Vector3d(force[0], force[1], force[2]);
  wrench.torque = -Eigen::Vector3d(moment[0], moment[1], moment[2]);
  return wrench;
}

int Twin::bullet_contacts() const {
  int count = 0;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    count += dispatcher_.getManifoldByIndexInternal(i)->getNumContacts();
  }
  return count;
}

}  // namespace walkman::peers
