#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "adaptation/parameters.h"
#include "adaptation/perception/pcd.h"
#include "adaptation/perception/stage_one.h"
#include "apps/capture/captured_files.h"
#include "apps/picture/png_file.h"
#include "apps/picture/seen_picture.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "urdf/reader/kinematics.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

constexpr Time kStep = std::chrono::milliseconds(10);
constexpr Time kLongestWait = std::chrono::seconds(5);

struct CaptureArguments {
  SceneCommandLine scene;
  std::string out;
  double at = 0.5;
  std::optional<std::int64_t> seed;
  bool locate = false;
  std::string sensor = "stereo";
  std::string noise;     // empty: the scene's
  double spindle = 0.6;  // rad/s
};

/// Returns the next frame, received through the camera's protocol.
camera::OrganizedCloud next_cloud(EmulatedWorld& world, EmbeddedCamera& camera) {
  const Time from = world.emulator.now();
  camera::OrganizedCloud cloud;
  while (!camera.client.latest(from, cloud)) {
    if (world.emulator.now() - from > kLongestWait)
      throw std::runtime_error("the emulated camera sent no frame in 5 s of emulated time");
    world.emulator.advance(world.emulator.now() + kStep);
  }
  return cloud;
}

/// Pose of the camera at each step, in W.
class CameraPath {
 public:
  explicit CameraPath(const EmulatedWorld& world)
      : world_(world), link_(world.robot.model.link_index(world.robot.description.optical_frame)) {
    note();
  }
  void note() { path_.emplace_back(world_.emulator.now(), world_.emulator.plant().X_WL(link_)); }
  /// Assumes uniform motion between two steps.
  [[nodiscard]] Eigen::Isometry3d X_WC(Time at) const {
    const auto after = std::upper_bound(path_.begin(), path_.end(), at,
                                        [](Time t, const auto& step) { return t < step.first; });
    if (after == path_.begin()) return path_.front().second;
    if (after == path_.end()) return path_.back().second;
    const auto& [from, a] = *(after - 1);
    const auto& [to, b] = *after;
    return pose_between(a, b,
                        static_cast<double>((at - from).count()) / static_cast<double>((to - from).count()));
  }
  [[nodiscard]] const Eigen::Isometry3d& last() const { return path_.back().second; }

 private:
  const EmulatedWorld& world_;
  int link_;
  std::vector<std::pair<Time, Eigen::Isometry3d>> path_;
};

/// Sweeps half a turn of the spindle, which covers every direction once. The points are in the left optical
/// frame at the end of the sweep, because a robot without a master sways meanwhile.
std::vector<multisense::Sweep::Point> next_sweep(EmulatedWorld& world, EmbeddedCamera& camera, double rate) {
  camera.client.spin(rate);
  multisense::Sweep sweep(camera.client.laser_calibration());
  const Time from = world.emulator.now();
  const Time longest = kLongestWait + std::chrono::milliseconds(std::llround(1e3 * std::numbers::pi / rate));
  CameraPath path(world);
  while (sweep.turned() < std::numbers::pi) {
    if (world.emulator.now() - from > longest)
      throw std::runtime_error("the emulated laser has not made half a turn in time");
    world.emulator.advance(world.emulator.now() + kStep);
    path.note();
    for (const multisense::LidarData& scan : camera.client.take_scans())
      sweep.add(scan, [&](Time at) { return path.X_WC(at); });
  }
  camera.client.spin(0);
  const Eigen::Isometry3f X_CW = path.last().inverse().cast<float>();
  std::vector<multisense::Sweep::Point> points_C = sweep.points();
  for (multisense::Sweep::Point& point : points_C) point.p_F = X_CW * point.p_F;
  return points_C;
}

/// Writes the frame that the camera's client receives, and the result of Stage I on it. Returns the files'
/// names.
std::vector<std::string> capture_frame(const CaptureArguments& options, EmulatedWorld& world,
                                       EmbeddedCamera& camera) {
  camera.client.also_stream(multisense::source::kLumaRectifiedLeft | multisense::source::kLumaRectifiedRight);
  const camera::OrganizedCloud cloud = next_cloud(world, camera);
  const std::filesystem::path folder = options.out;
  std::vector<std::string> files = write_captured(folder, camera.client, cloud);
  if (options.locate) {
    const StageOneParameters parameters =
        load_method_parameters(parameters_file(world.scene, data_directory())).stage_one;
    const perception::StageOneResult seen = perception::locate(cloud, parameters, std::nullopt);
    picture::write_png(seen_picture(cloud, seen), folder / "seen.png");
    files.emplace_back("seen.png");
  }
  return files;
}

int run_capture(const CaptureArguments& options) {
  const std::filesystem::path data = data_directory();
  WorldOptions world_options = world_of(options.scene, data);
  if (options.seed) world_options.seed = static_cast<std::uint64_t>(*options.seed);
  if (!options.noise.empty()) world_options.camera_noise = options.noise == "real";
  EmulatedWorld world(world_options);
  world.emulator.advance(std::chrono::milliseconds(std::llround(1e3 * options.at)));
  const std::filesystem::path folder = options.out;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(options.out + ": cannot be created: " + error.message());
  EmbeddedCamera camera(world.emulator);
  std::vector<std::string> files;
  if (options.sensor == "stereo") {
    files = capture_frame(options, world, camera);
  } else {
    const std::vector<multisense::Sweep::Point> sweep = next_sweep(world, camera, options.spindle);
    const MultiSense& sensor = world.emulator.camera();
    files = write_sweep(folder, sweep, sensor.exposure().X_WC.linear().row(2).transpose());
  }
  print(fmt::format("{}: {:.3f} s after the start\n", one_line(options.out),
                    std::chrono::duration<double>(world.emulator.now()).count()));
  for (const std::string& file : files) print("  " + file + "\n");
  return kOk;
}

}  // namespace

void add_capture_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<CaptureArguments>();
  CLI::App* command = app.add_subcommand(
      "capture", "Write what the emulated MultiSense sees in a scene: cloud, images, disparity, depth");
  command->add_option("--out", options->out, "Folder to write to")->required();
  add_scene_options(*command, options->scene);
  command->add_option("--at", options->at, "Seconds from the start; the robot has no master (0.5)")
      ->check(CLI::Range(0.0, 3600.0));
  command
      ->add_option("--seed", options->seed,
                   "Seed of the true robot, of the object's pose and of the sensors' noise")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_flag(
      "--locate", options->locate,
      "Run Stage I and write seen.png: plane, object, handles, centre of mass and grasp in the cloud");
  command
      ->add_option("--sensor", options->sensor, "stereo, a frame, or lidar, a sweep of half a turn (stereo)")
      ->check(CLI::IsMember({"stereo", "lidar"}));
  command->add_option("--noise", options->noise, "real, or none: the ideal sensor (default: the scene's)")
      ->check(CLI::IsMember({"real", "none"}));
  command->add_option("--spindle", options->spindle, "Rate at which the laser turns for a sweep, rad/s (0.6)")
      ->check(CLI::Range(0.01, 5.2));
  command->callback([&run, options] { run = [options] { return run_capture(*options); }; });
}

}  // namespace walkman::apps
