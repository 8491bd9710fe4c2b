#include "emulator/plant/plant.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <stdexcept>

#include <btBulletDynamicsCommon.h>
#include <fmt/format.h>

#include "emulator/plant/actuators/spindle.h"
#include "emulator/plant/contact/bullet_types.h"
#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/event_player.h"
#include "emulator/plant/dynamics/hoist.h"
#include "emulator/plant/dynamics/joint_stop.h"
#include "emulator/plant/dynamics/multibody.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/dynamics/self_collision.h"
#include "emulator/plant/dynamics/standing_load.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "emulator/plant/hands/soft_hand.h"
#include "emulator/plant/probes/wrench_probe.h"
#include "emulator/scene/standing_base.h"

namespace walkman::plant {
namespace {

/// A joint and the actuator that moves it.
struct JointDrive {
  int bullet_link;
  double damping;
  SeriesElasticActuator actuator;
  double torque_sum = 0;
  double torque = 0;  // N·m, mean of the last step
};

struct HandDrive {
  std::unique_ptr<SoftHand> hand;
  int palm_link;
  std::vector<SlipMeter> slips;  // one per object
};

/// A joint's actuator with its true parameters, and the calibration its drive assumes. The link encoder is
/// absolute, with the zero it was mounted or homed with; the motor encoder is set from it when the robot
/// boots with its springs unloaded and so inherits that zero, apart from the error of the torque's zero.
SeriesElasticActuator actuator_of(const ActuatorParameters& of_class, const DriveErrors& errors) {
  ActuatorParameters own = of_class;
  own.spring_constant *= errors.spring;
  own.viscous_friction *= errors.friction;
  own.coulomb_friction *= errors.friction;
  own.static_friction *= errors.friction;
  const double torque_zero = errors.torque_zero * of_class.peak_torque;
  return {
      own,
      SensorCalibration{of_class.spring_constant,
                        errors.encoder_zero + torque_zero / of_class.spring_constant, errors.encoder_zero},
      errors.gear};
}

/// Whether a drive of the device table is a hand or a joint, and its index among these.
struct DriveSlot {
  bool hand;
  int index;
};

/// Deepest overlap allowed at the start, m: bodies that start inside each other are thrown apart.
constexpr double kDeepestAtStart = 0.002;

std::vector<std::string> names_of(const DeviceTable& devices, DeviceKind kind) {
  std::vector<std::string> names;
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == kind) names.push_back(device.name);
    }
  }
  return names;
}

/// Returns the object with the fault applied.
SceneObject broken(SceneObject object, const ObjectFault& fault) {
  std::erase_if(object.weights, [&](const AttachedWeight& weight) {
    return std::find(fault.lost_weights.begin(), fault.lost_weights.end(), weight.name) !=
           fault.lost_weights.end();
  });
  for (Link& link : object.model.links) link.surface.friction *= fault.friction;
  if (fault.extra_mass <= 0) return object;
  // A point mass at the centre of mass, attached to the first link.
  Link& link = object.model.links.front();
  const Eigen::Vector3d arm = object.p_OOcm() - link.p_LLcm;
  const double mass = link.mass + fault.extra_mass;
  link.I_LLcm_L += link.mass * fault.extra_mass / mass *
                   (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  link.p_LLcm += fault.extra_mass / mass * arm;
  link.mass = mass;
  return object;
}

}  // namespace

struct Plant::Impl {
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const RobotModel* robot = nullptr;
  btDefaultCollisionConfiguration configuration;
  ContactDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  std::unique_ptr<SelfCollision> self_collision;
  std::unique_ptr<SelfCollisionFilter> self_collision_filter;
  RowSpaceSolver solver;
  PlantWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::unique_ptr<Multibody> body;
  std::vector<std::unique_ptr<StaticBody>> fixed;
  std::vector<std::unique_ptr<Multibody>> objects;
  std::vector<SceneObject> object_models;  // with their present weights and faults
  std::vector<SceneObject> sound_objects;  // without the faults
  std::vector<ObjectFault> object_faults;
  std::unique_ptr<Hoist> hoist;
  std::unique_ptr<EventPlayer> events;
  long steps = 0;
  std::vector<JointDrive> joints;
  std::vector<HandDrive> hands;
  std::optional<Spindle> spindle;
  std::vector<DriveSlot> drives;
  std::vector<std::unique_ptr<WrenchProbe>> probes;
  std::vector<std::unique_ptr<InertialProbe>> inertial_probes;
  std::unique_ptr<InertialProbe> camera_probe;
  std::vector<int> feet;       // Bullet's links on which a floating robot initially stands
  std::vector<int> sub_steps;  // taken since the last step, per drive
  double time = 0;
  double gravity = kGravity;

  void rebuild(std::size_t object) {
    object_models[object] = broken(sound_objects[object], object_faults[object]);
    rebuild_object(world, object_models[object], objects[object]);
    for (HandDrive& drive : hands) drive.slips[object].follow(*objects[object]);
  }

  void add_robot(const Scene& scene, const DeviceTable& devices,
                 const std::map<std::string, double>& posture);
  void add_drives(const DeviceTable& devices, const std::map<std::string, ActuatorParameters>& actuators,
                  const RobotErrors& errors);
  void add_probes(const DeviceTable& devices);
  void require_apart(const Scene& scene);
  void set_posture(const std::map<std::string, double>& posture);
  [[nodiscard]] std::string_view name_of(const btCollisionObject* object) const;
};

void Plant::Impl::add_robot(const Scene& scene, const DeviceTable& devices,
                            const std::map<std::string, double>& posture) {
  std::vector<std::string> cuts;  // fixed joints that carry a force/torque frame with a body below it
  for (const std::string& frame : names_of(devices, DeviceKind::kForceTorque)) {
    const Link& link = robot->links[static_cast<std::size_t>(robot->link_index(frame))];
    if (link.parent_joint < 0) continue;
    const bool carries = std::any_of(robot->joints.begin(), robot->joints.end(), [&](const Joint& joint) {
      return robot->links[static_cast<std::size_t>(joint.parent_link)].name == frame;
    });
    if (carries) cuts.push_back(robot->joints[static_cast<std::size_t>(link.parent_joint)].name);
  }
  std::vector<std::string> frozen = names_of(devices, DeviceKind::kHandDrive);
  const std::vector<std::string> driven = names_of(devices, DeviceKind::kJointDrive);
  for (const Joint& joint : robot->joints) {
    const bool moved = joint.mimic || std::find(driven.begin(), driven.end(), joint.name) != driven.end();
    const bool spins = scene.robot.laser && joint.name == scene.robot.laser->spindle;
    if (joint.type != JointType::kFixed && !moved && !spins) frozen.push_back(joint.name);
  }
  RigidTree tree(*robot, cuts, frozen);
  self_collision = std::make_unique<SelfCollision>(*robot, tree, posture);
  self_collision_filter = std::make_unique<SelfCollisionFilter>(*self_collision);
  broadphase.getOverlappingPairCache()->setOverlapFilterCallback(self_collision_filter.get());

  std::vector<int> foot_links;
  for (const std::string& frame : names_of(devices, DeviceKind::kForceTorque)) {
    const Link& link = robot->links[static_cast<std::size_t>(robot->link_index(frame))];
    if (link.parent_joint < 0) continue;
    const Joint& joint = robot->joints[static_cast<std::size_t>(link.parent_joint)];
    // A sensor with nothing below it sits in a foot.
    if (std::find(cuts.begin(), cuts.end(), joint.name) != cuts.end()) continue;
    foot_links.push_back(joint.parent_link);
  }
  body = std::make_unique<Multibody>(world, *robot, std::move(tree), scene.base == BaseKind::kFixed,
                                     scene.X_WB, kRobotGroup, kObjectGroup | kFixedGroup | kRobotGroup);
  body->bullet().setHasSelfCollision(true);
  if (scene.robot.laser) {
    const int joint = robot->joint_index(scene.robot.laser->spindle);
    spindle.emplace(body->bullet(), body->bullet_link(joint),
                    robot->joints[static_cast<std::size_t>(joint)].damping);
  }
  if (scene.base != BaseKind::kFloating) return;
  for (const int link : foot_links) feet.push_back(body->tree().group_of(link) - 1);
}

void Plant::Impl::add_drives(const DeviceTable& devices,
                             const std::map<std::string, ActuatorParameters>& actuators,
                             const RobotErrors& errors) {
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kForceTorque || device.kind == DeviceKind::kInertialUnit) continue;
      const auto found = actuators.find(device.actuator);
      if (found == actuators.end()) {
        throw std::runtime_error("drive '" + device.name + "' has actuator class '" + device.actuator +
                                 "', which the actuator file does not define");
      }
      if (device.kind == DeviceKind::kHandDrive) {
        drives.push_back({true, static_cast<int>(hands.size())});
        const auto synergy = static_cast<std::size_t>(robot->joint_index(device.name));
        hands.push_back(
            {std::make_unique<SoftHand>(*robot, *body, device.name, found->second, SoftHandParameters{}),
             robot->joints[synergy].parent_link,
             {}});
        continue;
      }
      const int index = robot->joint_index(device.name);
      const Joint& joint = robot->joints[static_cast<std::size_t>(index)];
      drives.push_back({false, static_cast<int>(joints.size())});
      joints.push_back({body->bullet_link(index), joint.damping,
                        actuator_of(found->second, errors.of_drive(device.name))});
      if (joint.type == JointType::kContinuous) continue;
      solver.add_stop(
          JointStop(body->bullet(), joints.back().bullet_link, joint.limits.lower, joint.limits.upper));
    }
  }
  sub_steps.assign(drives.size(), 0);
}

void Plant::Impl::add_probes(const DeviceTable& devices) {
  for (const std::string& frame : names_of(devices, DeviceKind::kForceTorque)) {
    const int link = robot->link_index(frame);
    probes.push_back(std::make_unique<WrenchProbe>(*body, link, body->tree().group_of(link)));
    world.add_probe(*probes.back());
  }
  for (const std::string& frame : names_of(devices, DeviceKind::kInertialUnit)) {
    inertial_probes.push_back(std::make_unique<InertialProbe>(*body, robot->link_index(frame)));
    world.add_probe(*inertial_probes.back());
  }
}

void Plant::Impl::set_posture(const std::map<std::string, double>& posture) {
  for (const HandDrive& drive : hands) drive.hand->reset();
  for (const auto& [name, value] : posture) {
    const int link = body->bullet_link(robot->joint_index(name));
    if (link >= 0) body->bullet().setJointPos(link, value);
  }
  body->update_poses();
  const std::vector<double> torques = holding_torques(*body, feet, gravity);
  for (JointDrive& drive : joints) {
    drive.actuator.reset(body->bullet().getJointPos(drive.bullet_link),
                         torques[static_cast<std::size_t>(drive.bullet_link)]);
  }
}

std::string_view Plant::Impl::name_of(const btCollisionObject* object) const {
  if (const auto* collider = btMultiBodyLinkCollider::upcast(object)) {
    if (collider->m_multiBody == &body->bullet()) {
      const auto group = static_cast<std::size_t>(collider->m_link) + 1;
      return robot->links[static_cast<std::size_t>(body->tree().groups()[group].root_link)].name;
    }
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (collider->m_multiBody == &objects[i]->bullet()) return object_models[i].name;
    }
  }
  for (const auto& candidate : fixed) {
    if (candidate->owns(object)) return candidate->name();
  }
  return "unknown";
}

void Plant::Impl::require_apart(const Scene& scene) {
  world.performDiscreteCollisionDetection();
  double deepest = kDeepestAtStart;
  const btPersistentManifold* found = nullptr;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const double depth = -manifold->getContactPoint(k).getDistance();
      if (depth <= deepest) continue;
      deepest = depth;
      found = manifold;
    }
  }
  if (!found) return;
  const btCollisionObject *inside = found->getBody0(), *other = found->getBody1();
  if (inside->isStaticObject()) std::swap(inside, other);
  throw StartsInside(fmt::format("{}: {} starts {:.1f} mm inside {}, expected at most {:g} mm",
                                 scene.file.string(), name_of(inside), 1e3 * deepest, name_of(other),
                                 1e3 * kDeepestAtStart));
}

Plant::Plant(const RobotModel& robot, const Scene& scene, const DeviceTable& devices,
             const std::map<std::string, ActuatorParameters>& actuators, const RobotErrors& errors)
    : impl_(std::make_unique<Impl>()) {
  Impl& p = *impl_;
  p.robot = &robot;
  p.gravity += errors.gravity;
  p.world.setGravity(btVector3(0, 0, -p.gravity));
  p.world.use_mid_step_velocities();
  btContactSolverInfo& info = p.world.getSolverInfo();
  info.m_numIterations = 50;
  info.m_leastSquaresResidualThreshold = 1e-12;  // (m/s)²: the last sweep changed no velocity by 1 um/s
  info.m_erp2 = 0.2;
  info.m_globalCfm = 0;
  info.m_linearSlop = 1e-5;  // without it, resting contacts vanish and reappear every few steps
  for (const FixedBody& fixed : scene.fixed) {
    p.fixed.push_back(std::make_unique<StaticBody>(p.world, fixed));
  }
  const std::map<std::string, double> posture =
      true_posture(load_posture(scene.robot.srdf, scene.posture, robot), errors);
  p.add_robot(scene, devices, posture);
  p.add_drives(devices, actuators, errors);
  p.add_probes(devices);
  if (!scene.robot.camera_imu.empty()) {
    p.camera_probe = std::make_unique<InertialProbe>(*p.body, robot.link_index(scene.robot.camera_imu));
    p.world.add_probe(*p.camera_probe);
  }
  for (const SceneObject& object : scene.objects) {
    p.objects.push_back(make_object(p.world, object));
    p.object_models.push_back(object);
    p.sound_objects.push_back(object);
    p.object_faults.emplace_back();
    for (HandDrive& drive : p.hands) drive.slips.emplace_back(*p.body, drive.palm_link, *p.objects.back());
  }
  p.set_posture(posture);
  p.require_apart(scene);
  if (scene.base == BaseKind::kHoisted) p.hoist = std::make_unique<Hoist>(scene, robot, *p.body);
  p.events = std::make_unique<EventPlayer>(
      scene, robot, *p.body, kStep, [&p](std::size_t object, const std::vector<AttachedWeight>& weights) {
        p.sound_objects[object].weights = weights;
        p.rebuild(object);
      });
}

Plant::~Plant() = default;

int Plant::drive_count() const { return static_cast<int>(impl_->drives.size()); }

const ActuatorReadings& Plant::readings(int drive) const {
  const DriveSlot slot = impl_->drives[static_cast<std::size_t>(drive)];
  const auto i = static_cast<std::size_t>(slot.index);
  return slot.hand ? impl_->hands[i].hand->readings() : impl_->joints[i].actuator.readings();
}

void Plant::advance_drive(int drive, double wanted_torque, bool locked) {
  Impl& p = *impl_;
  const DriveSlot slot = p.drives[static_cast<std::size_t>(drive)];
  constexpr double kSubStep = kStep / kSubSteps;
  const double since_step = kSubStep * p.sub_steps[static_cast<std::size_t>(drive)]++;
  if (slot.hand) {
    p.hands[static_cast<std::size_t>(slot.index)].hand->advance(wanted_torque, locked, since_step, kSubStep);
    return;
  }
  JointDrive& joint = p.joints[static_cast<std::size_t>(slot.index)];
  const double rate = p.body->bullet().getJointVel(joint.bullet_link);
  const double position = p.body->bullet().getJointPos(joint.bullet_link) + rate * since_step;
  joint.torque_sum += joint.actuator.advance(position, rate, wanted_torque, locked, kSubStep);
}

void Plant::set_actuator_fault(int drive, const ActuatorFault& fault) {
  const DriveSlot slot = impl_->drives[static_cast<std::size_t>(drive)];
  const auto index = static_cast<std::size_t>(slot.index);
  if (slot.hand) {
    impl_->hands[index].hand->set_fault(fault);
  } else {
    impl_->joints[index].actuator.set_fault(fault);
  }
}

void Plant::set_object_fault(int object, const ObjectFault& fault) {
  const auto index = static_cast<std::size_t>(object);
  impl_->object_faults[index] = fault;
  impl_->rebuild(index);
}

void Plant::push(int robot_link, const Eigen::Vector3d& force_W) {
  Multibody& body = *impl_->body;
  body.push_at(body.tree().group_of(robot_link), force_W, body.X_WL(robot_link).translation());
}

void Plant::turn_spindle(double rate) {
  if (impl_->spindle) impl_->spindle->turn(rate);
}

void Plant::begin_phase(std::string_view phase) { impl_->events->begin_phase(phase, impl_->steps); }

std::vector<SensorFaultEvent> Plant::take_sensor_faults() { return impl_->events->take_sensor_faults(); }

void Plant::step() {
  Impl& p = *impl_;
  btMultiBody& body = p.body->bullet();
  for (JointDrive& joint : p.joints) {
    const double rate = body.getJointVel(joint.bullet_link);
    joint.torque = joint.torque_sum / kSubSteps;
    body.addJointTorque(joint.bullet_link, joint.torque - joint.damping * rate);
    joint.torque_sum = 0;
  }
  for (HandDrive& drive : p.hands) drive.hand->apply();
  if (p.spindle) p.spindle->apply(kStep);
  if (p.hoist) p.hoist->apply();
  p.events->play(p.steps++);
  std::fill(p.sub_steps.begin(), p.sub_steps.end(), 0);
  p.world.stepSimulation(kStep, 0);
  for (HandDrive& drive : p.hands) {
    for (SlipMeter& meter : drive.slips) meter.update(p.dispatcher);
  }
  p.time += kStep;
}

const Wrench& Plant::F_So_S(int sensor) const {
  return impl_->probes[static_cast<std::size_t>(sensor)]->F_So_S();
}

const InertialMotion& Plant::inertial_motion(int unit) const {
  return impl_->inertial_probes[static_cast<std::size_t>(unit)]->motion();
}

const InertialMotion* Plant::camera_motion() const {
  return impl_->camera_probe ? &impl_->camera_probe->motion() : nullptr;
}

double Plant::time() const { return impl_->time; }

double Plant::gravity() const { return impl_->gravity; }

Eigen::Isometry3d Plant::X_WL(int robot_link) const { return impl_->body->X_WL(robot_link); }

Eigen::Isometry3d Plant::X_WO(int object) const {
  return impl_->objects[static_cast<std::size_t>(object)]->X_WL(0);
}

const SceneObject& Plant::object(int index) const {
  return impl_->object_models[static_cast<std::size_t>(index)];
}

double Plant::hoist_tension() const { return impl_->hoist ? impl_->hoist->tension() : 0; }

double Plant::joint_position(int robot_joint) const {
  const int link = impl_->body->bullet_link(robot_joint);
  return link < 0 ? 0 : impl_->body->bullet().getJointPos(link);
}

double Plant::joint_velocity(int robot_joint) const {
  const int link = impl_->body->bullet_link(robot_joint);
  return link < 0 ? 0 : impl_->body->bullet().getJointVel(link);
}

double Plant::joint_torque(int robot_joint) const {
  const int link = impl_->body->bullet_link(robot_joint);
  for (const JointDrive& joint : impl_->joints)
    if (joint.bullet_link == link) return joint.torque;
  return 0;
}

std::vector<AllowedOverlap> Plant::allowed_overlaps() const {
  const auto name = [&](int group) {
    return impl_->robot
        ->links[static_cast<std::size_t>(
            impl_->body->tree().groups()[static_cast<std::size_t>(group)].root_link)]
        .name;
  };
  std::vector<AllowedOverlap> pairs;
  for (const ExcusedPair& pair : impl_->self_collision->excused())
    pairs.push_back({name(pair.group_a), name(pair.group_b), to_string(pair.excuse)});
  return pairs;
}

std::vector<Contact> Plant::contacts() const {
  std::vector<Contact> contacts;
  const btDispatcher& dispatcher = impl_->dispatcher;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = impl_->dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      if (point.getAppliedImpulse() <= 0) continue;
      contacts.push_back({impl_->name_of(manifold->getBody0()), impl_->name_of(manifold->getBody1()),
                          from_bullet(point.getPositionWorldOnB()), point.getAppliedImpulse() / kStep});
    }
  }
  return contacts;
}

bool Plant::object_touches_fixed(int object) const {
  const std::string& name = impl_->object_models[static_cast<std::size_t>(object)].name;
  const auto is_fixed = [&](std::string_view other) {
    return std::any_of(impl_->fixed.begin(), impl_->fixed.end(),
                       [&](const auto& f) { return f->name() == other; });
  };
  for (const Contact& contact : contacts()) {
    if ((contact.body_a == name && is_fixed(contact.body_b)) ||
        (contact.body_b == name && is_fixed(contact.body_a))) {
      return true;
    }
  }
  return false;
}

double Plant::tendon_tension(int hand) const {
  return impl_->hands[static_cast<std::size_t>(hand)].hand->tension();
}

const Slip& Plant::slip(int hand, int object) const {
  const auto& slips = impl_->hands[static_cast<std::size_t>(hand)].slips;
  return slips[static_cast<std::size_t>(object)].slip();
}

std::uint64_t Plant::state_hash() const {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a
  const auto mix = [&](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int byte = 0; byte < 8; ++byte) {
      hash ^= (bits >> (8 * byte)) & 0xFFU;
      hash *= 1099511628211ULL;
    }
  };
  const auto mix_body = [&](const Multibody& multibody) {
    const btMultiBody& mb = multibody.bullet();
    for (int i = 0; i < mb.getNumLinks(); ++i) {
      if (mb.getLink(i).m_dofCount > 0) mix(mb.getJointPos(i));
    }
    for (int i = 0; i < 6 + mb.getNumDofs(); ++i) mix(mb.getVelocityVector()[i]);
    const btTransform pose = mb.getBaseWorldTransform();
    for (int i = 0; i < 3; ++i) mix(pose.getOrigin()[i]);
    for (int i = 0; i < 4; ++i) mix(pose.getRotation()[i]);
  };
  mix_body(*impl_->body);
  for (const auto& object : impl_->objects) mix_body(*object);
  return hash;
}

}  // namespace walkman::plant
