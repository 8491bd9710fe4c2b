#include "emulator/camera/multisense.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace walkman {
namespace {

constexpr double kOutOfSight = -10;  // m

/// All geometry of a rigid model in its root link's frame.
std::vector<LinkGeometry> rigid_geometry(const RobotModel& model) {
  std::vector<Eigen::Isometry3d> X_RL(model.links.size(), Eigen::Isometry3d::Identity());
  std::vector<LinkGeometry> all;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const int joint_index = model.links[i].parent_joint;
    if (joint_index >= 0) {
      const Joint& joint = model.joints[static_cast<std::size_t>(joint_index)];
      X_RL[i] = X_RL[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ;
    }
    for (LinkGeometry geometry : model.links[i].visuals) {
      geometry.X_LG = X_RL[i] * geometry.X_LG;
      all.push_back(std::move(geometry));
    }
  }
  return all;
}

}  // namespace

MultiSense::MultiSense(const RobotModel& robot, const Scene& scene, int optical_link,
                       const CameraParameters& parameters, std::uint64_t seed)
    : robot_(robot),
      camera_(std::make_unique<sensors::StereoCamera>(parameters.stereo)),
      object_count_(scene.objects.size()),
      optical_link_(optical_link),
      seed_(seed),
      period_ns_(period_of(parameters.rate_hz)) {
  for (const FixedBody& body : scene.fixed) rays_.add_fixed(rigid_geometry(body.model), body.X_WF);
  for (std::size_t i = 0; i < robot_.links.size(); ++i) {
    if (robot_.links[i].visuals.empty()) continue;
    (void)rays_.add_movable(robot_.links[i].visuals);
    robot_links_.push_back(static_cast<int>(i));
  }
  for (const SceneObject& object : scene.objects) {
    (void)rays_.add_movable(rigid_geometry(object.model));
  }
  for (std::size_t i = 0; i < object_count_; ++i) {
    for (const AttachedWeight& weight : scene.objects[i].weights) {
      (void)rays_.add_movable(rigid_geometry(weight.model));
      weights_.push_back({static_cast<int>(i), weight.name});
    }
  }
  if (!scene.robot.camera_imu.empty()) imu_.emplace(parameters.imu, seed);
  if (scene.robot.laser) laser_.emplace(robot, *scene.robot.laser, optical_link, parameters.laser, seed);
}

const LaserTurns& MultiSense::turns() const {
  static const LaserTurns none;
  return laser_ ? laser_->turns() : none;
}

const multisense::LidarCalibration* MultiSense::laser_calibration() const {
  return laser_ ? &laser_->calibration() : nullptr;
}

void MultiSense::advance(Time now, const plant::Plant& plant) {
  now_ = now;
  if (imu_ && plant.camera_motion() != nullptr) imu_->advance(now, *plant.camera_motion());
  if (laser_) {
    if (laser_->advance(now, plant)) {
      std::vector<Eigen::Isometry3d> poses;
      note_poses(plant, poses);
      laser_->halfway(std::move(poses));
    }
  }
  if (now < next_) return;
  while (next_ <= now) next_ += Time(period_ns_.load());
  if (fault_.blind) return;
  ++exposure_.frame;
  if (fault_.stale && exposure_.stamp != Time::min()) return;
  exposure_.stamp = now;
  exposure_.spindle_angle = laser_ ? laser_->angle() : 0;
  exposure_.X_WC = plant.X_WL(optical_link_) * fault_.X_CF;
  exposure_.dropout = fault_.dropout;
  exposure_.dropout_seed = fault_.seed;
  exposure_.phantom = fault_.phantom;
  exposure_.hidden = fault_.hidden;
  note_poses(plant, exposure_.poses);
}

void MultiSense::note_poses(const plant::Plant& plant, std::vector<Eigen::Isometry3d>& poses) const {
  poses.clear();
  for (const int link : robot_links_) poses.push_back(plant.X_WL(link));
  for (std::size_t i = 0; i < object_count_; ++i) poses.push_back(plant.X_WO(static_cast<int>(i)));
  for (const Weight& weight : weights_) poses.push_back(pose_of(weight, plant));
}

Eigen::Isometry3d MultiSense::pose_of(const Weight& weight, const plant::Plant& plant) {
  const SceneObject& object = plant.object(weight.object);
  const auto found = std::find_if(object.weights.begin(), object.weights.end(),
                                  [&](const AttachedWeight& w) { return w.name == weight.name; });
  if (found != object.weights.end()) return plant.X_WO(weight.object) * object.X_OA(*found);
  // Removed: out of sight below the floor.
  Eigen::Isometry3d X_WA = Eigen::Isometry3d::Identity();
  X_WA.translation().z() = kOutOfSight;
  return X_WA;
}

std::int64_t MultiSense::period_of(double rate_hz) {
  return static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
}

double MultiSense::rate_hz() const { return 1e9 / static_cast<double>(period_ns_); }

MultiSense::Mode MultiSense::mode() const {
  const sensors::StereoOptions& now = optics();
  return {now.width, now.height, now.max_disparity};
}

void MultiSense::set_mode(const Mode& mode) {
  if (mode == this->mode()) return;
  sensors::StereoOptions options = optics();
  const double across = static_cast<double>(mode.width) / options.width;
  options.focal_px *= across;
  options.cx *= across;
  options.cy = options.cy * across - (options.height * across - mode.height) / 2;
  options.width = mode.width;
  options.height = mode.height;
  options.max_disparity = mode.disparities;
  camera_ = std::make_unique<sensors::StereoCamera>(options);
}

void MultiSense::match_nothing(const CameraFault::Phantom& phantom) {
  const sensors::StereoOptions& camera = optics();
  const auto d = static_cast<float>(camera.focal_px * camera.baseline / phantom.distance);
  const auto middle = [&](int length) {
    return std::pair(std::max(0, (length - phantom.size) / 2), std::min(length, (length + phantom.size) / 2));
  };
  const auto [left, right] = middle(camera.width);
  const auto [top, bottom] = middle(camera.height);
  for (int row = top; row < bottom; ++row) {
    const auto first = disparity_.begin() + static_cast<std::ptrdiff_t>(row) * camera.width;
    std::fill(first + left, first + right, d);
  }
}

void MultiSense::render(const Exposure& exposure, bool images, Frame& out) {
  rays_.update(exposure.poses);
  camera_->capture(rays_, exposure.X_WC, seed_, exposure.frame, disparity_, images ? &images_ : nullptr);
  multisense::Disparity& disparity = out.disparity;
  disparity.frame = static_cast<std::int64_t>(exposure.frame);
  disparity.width = static_cast<std::uint16_t>(optics().width);
  disparity.height = static_cast<std::uint16_t>(optics().height);
  if (exposure.dropout > 0) {
    std::mt19937_64 generator(exposure.dropout_seed ^ exposure.frame);
    std::bernoulli_distribution lost(exposure.dropout);
    for (float& d : disparity_)
      if (lost(generator)) d = 0;
  }
  if (exposure.phantom) match_nothing(*exposure.phantom);
  const auto column = [&](double share) { return static_cast<std::ptrdiff_t>(share * optics().width); };
  for (auto row = disparity_.begin(); exposure.hidden.to > exposure.hidden.from && row != disparity_.end();
       row += optics().width)
    std::fill(row + column(exposure.hidden.from), row + column(exposure.hidden.to), 0.F);
  multisense::quantize(disparity_, disparity.pixels);
  if (!images) return;
  const auto fill = [&](std::vector<std::uint8_t>& pixels, multisense::Image& image) {
    image.bits = 8;
    image.frame = disparity.frame;
    image.width = disparity.width;
    image.height = disparity.height;
    image.pixels.swap(pixels);
  };
  fill(images_.left, out.left);
  fill(images_.right, out.right);
}

void MultiSense::scan(const LaserTurn& turn, multisense::LidarData& out) {
  rays_.place(turn.poses);
  laser_->scan(rays_, turn, out);
}

}  // namespace walkman
