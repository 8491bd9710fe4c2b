#include "emulator/scene/true_robot.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "emulator/scene/draws.h"
#include "emulator/scene/robot_parts.h"
#include "urdf/reader/kinematics.h"

namespace walkman {
namespace {

constexpr double kLeastFactor = 0.2;  // minimum share of a positive quantity that a draw leaves

double factor(double share) { return std::max(kLeastFactor, 1 + share); }

Eigen::Isometry3d displacement(const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = translation;
  const double angle = rotation.norm();
  if (angle > 0) X.linear() = Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
  return X;
}

/// Scales the principal second moments of the mass, ∫x² dm: the result is again the inertia of a body, whose
/// principal moments are sums of two of them.
Eigen::Matrix3d spread_inertia(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& shares) {
  const Eigen::Matrix3d second = 0.5 * inertia.trace() * Eigen::Matrix3d::Identity() - inertia;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(second);
  Eigen::Vector3d moments = principal.eigenvalues();
  for (Eigen::Index i = 0; i < 3; ++i) moments[i] *= factor(shares[i]);
  const Eigen::Matrix3d spread =
      principal.eigenvectors() * moments.asDiagonal() * principal.eigenvectors().transpose();
  return spread.trace() * Eigen::Matrix3d::Identity() - spread;
}

/// A true robot under construction.
class Drawing {
 public:
  Drawing(const RobotModel& nominal, const DeviceTable& devices, const ModelError& error, std::uint64_t seed)
      : parts_(nominal, devices), error_(error), seed_(seed) {
    robot_.model = nominal;
  }

  void weigh(const WeighedPart& part);
  void masses();
  void shapes_of_mass();
  void joints();
  void hands();
  void mounting(const std::string& frame, ErrorKind origin, ErrorKind rotation);
  void imu(const std::string& frame);
  void drives();
  void gains(const std::string& frame);
  void surroundings();
  [[nodiscard]] TrueRobot take() { return std::move(robot_); }

 private:
  [[nodiscard]] double scalar(ErrorKind kind, const std::string& of);
  [[nodiscard]] double one(ErrorKind kind, Draws& draws) const;
  [[nodiscard]] Eigen::Vector3d vector(ErrorKind kind, const std::string& of);
  void remount(const std::string& frame, const Eigen::Isometry3d& X_NF);
  void scale_mass(std::size_t link, double by);
  [[nodiscard]] bool any(ErrorKind kind) const { return error_.of(kind).any(); }
  [[nodiscard]] Link& link(std::size_t index) { return robot_.model.links[index]; }

  TrueRobot robot_;
  RobotParts parts_;
  const ModelError& error_;
  std::uint64_t seed_;
};

double Drawing::one(ErrorKind kind, Draws& draws) const {
  const Spread& spread = error_.of(kind);
  const bool outlier = draws.uniform() < error_.outlier_share && spread.most > 0;
  if (!outlier) return spread.sigma * draws.normal();
  return std::copysign(spread.least + draws.uniform() * (spread.most - spread.least), draws.symmetric());
}

double Drawing::scalar(ErrorKind kind, const std::string& of) {
  if (!any(kind)) return 0;
  Draws draws(seed_, name_of(kind).key, of);
  const double value = one(kind, draws);
  robot_.draws.push_back({kind, of, {value}});
  return value;
}

Eigen::Vector3d Drawing::vector(ErrorKind kind, const std::string& of) {
  if (!any(kind)) return Eigen::Vector3d::Zero();
  const Spread& spread = error_.of(kind);
  Draws draws(seed_, name_of(kind).key, of);
  const bool outlier = draws.uniform() < error_.outlier_share && spread.most > 0;
  Eigen::Vector3d value;
  for (double& axis : value) axis = draws.normal();
  if (outlier) {
    value *= (spread.least + draws.uniform() * (spread.most - spread.least)) / value.norm();
  } else {
    value *= spread.sigma;
  }
  robot_.draws.push_back({kind, of, {value.begin(), value.end()}});
  return value;
}

void Drawing::scale_mass(std::size_t index, double by) {
  link(index).mass *= by;
  link(index).I_LLcm_L *= by;
}

void Drawing::weigh(const WeighedPart& part) {
  const auto below = robot_.model.find_link(part.below), carrier = robot_.model.find_link(part.carried_by);
  if (!below || !carrier)
    throw std::runtime_error(
        fmt::format("{}: there is no link '{}', expected it for model_error's weighed_parts "
                    "(weighed_parts: no leaves them out)",
                    robot_.model.file.string(), below ? part.carried_by : part.below));
  double mass = 0;
  for (const std::size_t i : links_below(robot_.model, static_cast<std::size_t>(*below)))
    mass += link(i).mass;
  const auto carrying = static_cast<std::size_t>(*carrier);
  const double carried = link(carrying).mass + part.mass - mass;
  if (!(link(carrying).mass > 0) || !(carried > 0))
    throw std::runtime_error(fmt::format(
        "{}: below '{}' there are {:.3f} kg, of which '{}' has {:.3f}, expected masses that can "
        "be adjusted to the {:.3f} kg of weighed_parts",
        robot_.model.file.string(), part.below, mass, part.carried_by, link(carrying).mass, part.mass));
  scale_mass(carrying, carried / link(carrying).mass);
}

void Drawing::masses() {
  // Total masses of the chains without the errors of single links.
  std::map<std::size_t, double> nominal, drawn;
  for (const std::size_t i : parts_.chain_links()) nominal[parts_.chain(i)] += link(i).mass;
  if (any(ErrorKind::kLinkMass)) {
    for (const std::size_t i : parts_.chain_links())
      if (link(i).mass > 0) scale_mass(i, factor(scalar(ErrorKind::kLinkMass, link(i).name)));
  }
  if (any(ErrorKind::kLinkMass) || any(ErrorKind::kChainMass)) {
    for (const std::size_t i : parts_.chain_links()) drawn[parts_.chain(i)] += link(i).mass;
    for (auto& [first, mass] : nominal) {
      if (mass > 0) mass *= factor(scalar(ErrorKind::kChainMass, link(first).name)) / drawn[first];
    }
    for (const std::size_t i : parts_.chain_links()) {
      if (link(i).mass > 0) scale_mass(i, nominal[parts_.chain(i)]);
    }
  }
  if (!any(ErrorKind::kHandMass)) return;
  for (const RobotParts::Hand& hand : parts_.hands()) {
    double mass = 0;
    for (const std::size_t i : hand.links) mass += link(i).mass;
    if (!(mass > 0)) continue;
    const double by = factor(scalar(ErrorKind::kHandMass, hand.frame) / mass);
    for (const std::size_t i : hand.links) scale_mass(i, by);
  }
}

void Drawing::shapes_of_mass() {
  // A hand is one body here: its heaviest link takes the change of the whole hand.
  const auto heaviest = [&](const RobotParts::Hand& hand) {
    return *std::max_element(hand.links.begin(), hand.links.end(),
                             [&](std::size_t a, std::size_t b) { return link(a).mass < link(b).mass; });
  };
  const auto draw = [&](std::size_t i, double mass) {
    Link& body = link(i);
    if (!(body.mass > 0)) return;
    if (any(ErrorKind::kLinkCom)) body.p_LLcm += mass / body.mass * vector(ErrorKind::kLinkCom, body.name);
    if (any(ErrorKind::kInertia))
      body.I_LLcm_L = spread_inertia(body.I_LLcm_L, vector(ErrorKind::kInertia, body.name));
  };
  for (const std::size_t i : parts_.chain_links()) draw(i, link(i).mass);
  for (const RobotParts::Hand& hand : parts_.hands()) {
    const double mass = std::accumulate(hand.links.begin(), hand.links.end(), 0.0,
                                        [&](double sum, std::size_t i) { return sum + link(i).mass; });
    draw(heaviest(hand), mass);
  }
}

void Drawing::joints() {
  if (!any(ErrorKind::kJointOrigin) && !any(ErrorKind::kJointTilt)) return;
  for (const std::string& name : parts_.driven_joints()) {
    Joint& joint = robot_.model.joints[static_cast<std::size_t>(robot_.model.joint_index(name))];
    if (any(ErrorKind::kJointOrigin)) joint.X_PJ.translation() += vector(ErrorKind::kJointOrigin, name);
    if (!any(ErrorKind::kJointTilt)) continue;
    // A tilt about the axis itself would be an encoder zero error.
    const Eigen::Vector3d tilt = vector(ErrorKind::kJointTilt, name);
    joint.X_PJ = joint.X_PJ * displacement(Eigen::Vector3d::Zero(), tilt - tilt.dot(joint.axis) * joint.axis);
  }
}

void Drawing::hands() {
  if (!any(ErrorKind::kHandOrigin) && !any(ErrorKind::kHandRotation)) return;
  for (const RobotParts::Hand& hand : parts_.hands()) {
    const Eigen::Isometry3d X = displacement(vector(ErrorKind::kHandOrigin, hand.frame),
                                             vector(ErrorKind::kHandRotation, hand.frame));
    for (const std::size_t joint : hand.mountings)
      robot_.model.joints[joint].X_PJ = X * robot_.model.joints[joint].X_PJ;
  }
}

/// Moves a frame and nothing else: everything attached to it and its link's mass and shapes stay where they
/// are.
void Drawing::remount(const std::string& frame, const Eigen::Isometry3d& X_NF) {
  RobotModel& model = robot_.model;
  const int index = model.link_index(frame);
  const int carrier = link(static_cast<std::size_t>(index)).parent_joint;
  if (carrier < 0 || model.joints[static_cast<std::size_t>(carrier)].type != JointType::kFixed)
    throw std::runtime_error(
        fmt::format("{}: the frame '{}' is not attached by a fixed joint, expected one whose mounting "
                    "model_error can move",
                    model.file.string(), frame));
  const Eigen::Isometry3d X_FN = X_NF.inverse();
  Joint& mounting = model.joints[static_cast<std::size_t>(carrier)];
  mounting.X_PJ = mounting.X_PJ * X_NF;
  for (Joint& joint : model.joints) {
    if (joint.parent_link == index) joint.X_PJ = X_FN * joint.X_PJ;
  }
  Link& body = link(static_cast<std::size_t>(index));
  body.p_LLcm = X_FN * body.p_LLcm;
  body.I_LLcm_L = X_FN.linear() * body.I_LLcm_L * X_FN.linear().transpose();
  for (LinkGeometry& geometry : body.collisions) geometry.X_LG = X_FN * geometry.X_LG;
  for (LinkGeometry& geometry : body.visuals) geometry.X_LG = X_FN * geometry.X_LG;
}

void Drawing::mounting(const std::string& frame, ErrorKind origin, ErrorKind rotation) {
  if (!any(origin) && !any(rotation)) return;
  const Eigen::Vector3d translation = vector(origin, frame);
  remount(frame, displacement(translation, vector(rotation, frame)));
}

void Drawing::imu(const std::string& frame) {
  if (any(ErrorKind::kImuRotation))
    remount(frame, displacement(Eigen::Vector3d::Zero(), vector(ErrorKind::kImuRotation, frame)));
}

void Drawing::drives() {
  const bool drawn = any(ErrorKind::kSpring) || any(ErrorKind::kFriction) || any(ErrorKind::kJointZero) ||
                     any(ErrorKind::kTorqueZero) || any(ErrorKind::kGearError);
  if (!drawn) return;
  for (const std::string& name : parts_.driven_joints()) {
    DriveErrors& drive = robot_.errors.drives[name];
    drive.spring = factor(scalar(ErrorKind::kSpring, name));
    drive.friction = factor(scalar(ErrorKind::kFriction, name));
    drive.encoder_zero = scalar(ErrorKind::kJointZero, name);
    drive.torque_zero = scalar(ErrorKind::kTorqueZero, name);
    const double share = std::sqrt(0.5);
    drive.gear = {share * scalar(ErrorKind::kGearError, name + " sine"),
                  share * scalar(ErrorKind::kGearError, name + " cosine")};
    robot_.model.joints[static_cast<std::size_t>(robot_.model.joint_index(name))].damping *= drive.friction;
  }
}

void Drawing::gains(const std::string& frame) {
  using enum ErrorKind;
  if (!any(kAxialForceGain) && !any(kLateralForceGain) && !any(kTorqueGain) && !any(kCrossTalk) &&
      !any(kForcePerTorque) && !any(kTorquePerForce))
    return;
  static constexpr std::array kChannels = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  Eigen::Matrix<double, 6, 6>& gains = robot_.errors.force_torque_gains[frame];
  gains.setIdentity();
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    for (std::size_t k = 0; k < kChannels.size(); ++k) {
      const bool force = i < 3, of_force = k < 3;
      const ErrorKind kind = force != of_force ? (force ? kForcePerTorque : kTorquePerForce)
                             : i != k          ? kCrossTalk
                             : !force          ? kTorqueGain
                             : i == 2          ? kAxialForceGain
                                               : kLateralForceGain;
      gains(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) +=
          scalar(kind, fmt::format("{} {}/{}", frame, kChannels[i], kChannels[k]));
    }
  }
}

void Drawing::surroundings() {
  robot_.errors.gravity = scalar(ErrorKind::kGravity, "");
  if (!any(ErrorKind::kPadFriction)) return;
  for (const RobotParts::Hand& hand : parts_.hands()) {
    const double by = factor(scalar(ErrorKind::kPadFriction, hand.frame));
    for (const std::size_t i : hand.links) link(i).surface.friction *= by;
  }
}

}  // namespace

DriveErrors RobotErrors::of_drive(const std::string& joint) const {
  const auto found = drives.find(joint);
  return found == drives.end() ? DriveErrors{} : found->second;
}

double ErrorDraw::size() const {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0));
}

TrueRobot draw_true_robot(const RobotModel& nominal, const DeviceTable& devices,
                          const std::string& optical_frame, const ModelError& error, std::uint64_t seed) {
  Drawing drawing(nominal, devices, error, seed);
  for (const WeighedPart& part : error.weighed_parts) drawing.weigh(part);
  drawing.masses();
  drawing.shapes_of_mass();
  drawing.joints();
  drawing.hands();
  drawing.mounting(optical_frame, ErrorKind::kCameraOrigin, ErrorKind::kCameraRotation);
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kInertialUnit) drawing.imu(device.name);
      if (device.kind != DeviceKind::kForceTorque) continue;
      drawing.mounting(device.name, ErrorKind::kForceTorqueOrigin, ErrorKind::kForceTorqueRotation);
      drawing.gains(device.name);
    }
  }
  drawing.drives();
  drawing.surroundings();
  return drawing.take();
}

}  // namespace walkman
