#include "emulator/camera/laser.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "urdf/reader/kinematics.h"

namespace walkman {
namespace {

constexpr Time kTurn = std::chrono::milliseconds(25);
constexpr Time kStep = std::chrono::milliseconds(1);
// From the first beam to the last: 1080 of 1440 steps of a turn are 18.75 ms.
constexpr std::size_t kSteps = 20;
constexpr std::size_t kHalfway = 10;

/// Axes of the laser frame on the wire (z along the beam, y along the mirror's axis) in those of a link with
/// x along the middle beam and z along the mirror's axis.
Eigen::Matrix3d wire_axes() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return R;
}

/// Largest distance of a shape from a point in its own frame, m.
double reach_of(const LinkGeometry& geometry, const Eigen::Vector3d& p_G) {
  if (const auto* box = std::get_if<BoxShape>(&geometry.shape))
    return (p_G.cwiseAbs() + 0.5 * box->size).norm();
  if (const auto* cylinder = std::get_if<CylinderShape>(&geometry.shape))
    return std::hypot(p_G.head<2>().norm() + cylinder->radius, std::abs(p_G.z()) + 0.5 * cylinder->length);
  if (const auto* sphere = std::get_if<SphereShape>(&geometry.shape)) return p_G.norm() + sphere->radius;
  double reach = 0;
  for (const Eigen::Vector3d& vertex : std::get<MeshShape>(geometry.shape).vertices)
    reach = std::max(reach, (vertex - p_G).norm());
  return reach;
}

/// A laser sits in its camera's housing, which a URDF models as one solid: beams begin outside it.
sensors::LidarOptions outside_of(const Link& housing, const Eigen::Vector3d& p_HL,
                                 sensors::LidarOptions options) {
  for (const LinkGeometry& geometry : housing.visuals)
    options.least_range = std::max(options.least_range, reach_of(geometry, geometry.X_LG.inverse() * p_HL));
  return options;
}

const Joint& joint_of(const RobotModel& robot, const LaserParts& parts) {
  return robot.joints[static_cast<std::size_t>(robot.joint_index(parts.spindle))];
}

/// Position of the laser in the frame of the link that carries its spindle.
Eigen::Vector3d place_of(const RobotModel& robot, const LaserParts& parts, const Joint& spindle) {
  const std::vector<Eigen::Isometry3d> X_RL = link_poses(robot, {});
  return X_RL[static_cast<std::size_t>(spindle.parent_link)].inverse() *
         X_RL[static_cast<std::size_t>(robot.link_index(parts.frame))].translation();
}

std::array<float, 16> rows_of(const Eigen::Isometry3d& X) {
  std::array<float, 16> rows{};
  Eigen::Map<Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(rows.data()) = X.matrix().cast<float>();
  return rows;
}

}  // namespace

Laser::Laser(const RobotModel& robot, const LaserParts& parts, int camera_link,
             const sensors::LidarOptions& options, std::uint64_t seed)
    : carrier_(joint_of(robot, parts).parent_link),
      spindle_(robot.joint_index(parts.spindle)),
      lidar_(outside_of(robot.links[static_cast<std::size_t>(carrier_)],
                        place_of(robot, parts, joint_of(robot, parts)), options),
             seed) {
  const Joint& joint = joint_of(robot, parts);
  const std::vector<Eigen::Isometry3d> X_RL = link_poses(robot, {});
  const auto of = [&](int link) { return X_RL[static_cast<std::size_t>(link)]; };
  Eigen::Isometry3d X_WireL = Eigen::Isometry3d::Identity();
  X_WireL.linear() = wire_axes();
  const Eigen::Isometry3d X_RLaser = of(robot.link_index(parts.frame)) * X_WireL;
  // The spindle's frame has its origin at its joint, z along the axis, and y as close to the laser's as
  // possible.
  Eigen::Isometry3d X_RSp = of(joint.child_link);
  const Eigen::Vector3d z = X_RSp.linear() * joint.axis;
  const Eigen::Vector3d x = Eigen::Vector3d(X_RLaser.linear().col(1)).cross(z).normalized();
  X_RSp.linear() << x, z.cross(x), z;
  X_HSp_ = of(carrier_).inverse() * X_RSp;
  X_SpL_ = X_RSp.inverse() * X_RLaser;
  calibration_.X_SpL = rows_of(X_SpL_);
  calibration_.X_CSp = rows_of(of(camera_link).inverse() * X_RSp);
}

bool Laser::advance(Time now, const plant::Plant& plant) {
  angle_ = plant.joint_position(spindle_);
  const auto phase = static_cast<std::size_t>(now % kTurn / kStep);
  if (phase == 0) {
    turn_ = std::make_shared<LaserTurn>();
    turn_->number = ++number_;
    turn_->first = now;
  }
  if (!turn_ || phase >= kSteps) return false;
  turn_->X_WH.push_back(plant.X_WL(carrier_));
  turn_->angles.push_back(angle_);
  if (phase + 1 == kSteps) {
    turns_.push_back(std::move(turn_));
    if (turns_.size() > kKept) turns_.pop_front();
  }
  return phase == kHalfway;
}

Eigen::Isometry3d Laser::X_WL(const LaserTurn& turn, double seconds) const {
  const double steps =
      std::min(seconds / std::chrono::duration<double>(kStep).count(), static_cast<double>(kSteps - 1));
  const auto before = std::min(static_cast<std::size_t>(steps), kSteps - 2);
  const double share = steps - static_cast<double>(before);
  const Eigen::Isometry3d X_WH = pose_between(turn.X_WH[before], turn.X_WH[before + 1], share);
  const double angle = turn.angles[before] + share * (turn.angles[before + 1] - turn.angles[before]);
  return X_WH * X_HSp_ * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * X_SpL_;
}

void Laser::scan(const sensors::RayScene& scene, const LaserTurn& turn, multisense::LidarData& out) {
  lidar_.scan(
      scene, [&](double seconds) { return X_WL(turn, seconds); }, turn.number, scan_);
  const sensors::LidarOptions& options = lidar_.options();
  const double span = options.beam_period * (options.beams - 1);
  out.number = static_cast<std::uint32_t>(turn.number);
  out.first = multisense::sensor_time(turn.first);
  out.last = multisense::sensor_time(turn.first + Time(std::llround(1e9 * span)));
  // The spindle's encoder reading at that time; between two physics steps it turns at a constant rate.
  const auto steps = static_cast<std::size_t>(span / std::chrono::duration<double>(kStep).count());
  const double share = span / std::chrono::duration<double>(kStep).count() - static_cast<double>(steps);
  const double last = turn.angles[steps] + share * (turn.angles[steps + 1] - turn.angles[steps]);
  out.first_microradians = multisense::microradians(turn.angles.front());
  out.last_microradians = multisense::microradians(last);
  out.ranges_mm.clear();
  out.intensities.clear();
  for (const float range : scan_.ranges) {
    const bool seen = std::isfinite(range) && range > 0;
    out.ranges_mm.push_back(seen ? static_cast<std::uint32_t>(std::lround(1e3F * range))
                                 : multisense::LidarData::kNoReturn);
  }
  for (const float intensity : scan_.intensities)
    out.intensities.push_back(static_cast<std::uint32_t>(std::lround(intensity)));
}

}  // namespace walkman
