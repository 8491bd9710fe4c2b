// A stereo frame up to the client's cloud, its parts, and Bullet's ray test on a sixteenth of the same rays.
//
// Scene 0 is that of the first experiment; scene 1 has a similar number of bodies but 140,000 triangles.

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <benchmark/benchmark.h>
#include <btBulletCollisionCommon.h>
#include <time.h>

#include "drivers/camera/multisense/camera.h"
#include "emulator/scene/scene.h"
#include "sensors/ray_scene.h"
#include "sensors/spinning_lidar.h"
#include "sensors/stereo_camera.h"
#include "sensors/stereo_rays.h"
#include "urdf/reader/kinematics.h"
#include "urdf/reader/robot_model.h"

namespace {

using walkman::LinkGeometry;
using walkman::sensors::RayScene;
using walkman::sensors::StereoCamera;
using walkman::sensors::StereoOptions;
using walkman::sensors::StereoRays;

struct Body {
  std::vector<LinkGeometry> geometry;
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
};

struct World {
  std::vector<Body> fixed, movable;
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();

  [[nodiscard]] std::vector<Eigen::Isometry3d> poses() const {
    std::vector<Eigen::Isometry3d> all;
    for (const Body& body : movable) all.push_back(body.X_WL);
    return all;
  }
  /// The poses, and others: every movable body is displaced by 8 mm and turned by 0.05 rad.
  [[nodiscard]] std::array<std::vector<Eigen::Isometry3d>, 2> two_poses() const {
    Eigen::Isometry3d X_LM(Eigen::AngleAxisd(0.05, Eigen::Vector3d(1, 2, 2).normalized()));
    X_LM.translation().setConstant(0.008 / std::sqrt(3.0));
    std::array<std::vector<Eigen::Isometry3d>, 2> both{poses(), poses()};
    for (Eigen::Isometry3d& X_WL : both[1]) X_WL = X_WL * X_LM;
    return both;
  }
  void fill(RayScene& scene) const {
    for (const Body& body : fixed) scene.add_fixed(body.geometry, body.X_WL);
    for (const Body& body : movable) benchmark::DoNotOptimize(scene.add_movable(body.geometry));
    scene.update(poses());
  }
};

void add_model(const walkman::RobotModel& model, const std::map<std::string, double>& posture,
               const Eigen::Isometry3d& X_WR, std::vector<Body>& bodies) {
  const std::vector<Eigen::Isometry3d> X_RL = walkman::link_poses(model, posture);
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (!model.links[i].visuals.empty()) bodies.push_back({model.links[i].visuals, X_WR * X_RL[i]});
  }
}

World experiment_world() {
  const walkman::Scene scene =
      walkman::load_scene(std::filesystem::path(WALKMAN_URDF_DIR) / "scenes" / "experiment_1.yaml");
  const walkman::RobotModel robot = walkman::load_robot_model(scene.robot.urdf);
  const auto posture = walkman::load_posture(scene.robot.srdf, scene.posture, robot);
  World world;
  for (const auto& body : scene.fixed) add_model(body.model, {}, body.X_WF, world.fixed);
  add_model(robot, posture, scene.X_WB, world.movable);
  for (const auto& object : scene.objects) add_model(object.model, {}, object.X_WO, world.movable);
  const auto camera = static_cast<std::size_t>(robot.link_index("multisense/left_camera_optical_frame"));
  world.X_WC = scene.X_WB * walkman::link_poses(robot, posture)[camera];
  return world;
}

Eigen::Isometry3d look_at(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d z = (to - from).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  X_WC.linear() << x, z.cross(x), z;
  X_WC.translation() = from;
  return X_WC;
}

/// A rod with round ends from a to b, as a mesh of 24 x 46 quads.
Body rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  constexpr int kSegments = 24;
  constexpr int kRings = 46;
  walkman::MeshShape mesh;
  const double half = 0.5 * (b - a).norm();
  for (int r = 0; r <= kRings; ++r) {
    const double t = static_cast<double>(r) / kRings;
    const double angle = std::numbers::pi * (t - 0.5);
    const double z = half * (2 * t - 1) + radius * std::sin(angle);
    const double ring = radius * std::sqrt(std::max(std::cos(angle), 0.0));
    for (int s = 0; s < kSegments; ++s) {
      const double around = 2 * std::numbers::pi * s / kSegments;
      mesh.vertices.emplace_back(ring * std::cos(around), ring * std::sin(around), z);
    }
    for (int s = 0; r > 0 && s < kSegments; ++s) {
      const int low = (r - 1) * kSegments;
      const int next = (s + 1) % kSegments;
      mesh.triangles.emplace_back(low + s, low + next, low + kSegments + next);
      mesh.triangles.emplace_back(low + s, low + kSegments + next, low + kSegments + s);
    }
  }
  Body body;
  body.geometry = {{Eigen::Isometry3d::Identity(), mesh, "rod"}};
  body.X_WL.translation() = 0.5 * (a + b);
  body.X_WL.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), b - a).toRotationMatrix();
  return body;
}

/// Room and table of the experiment; two arms and hands made of rods in view, legs and torso out of view.
World dense_world() {
  World world;
  world.fixed = experiment_world().fixed;
  for (const double side : {-1.0, 1.0}) {
    const auto at = [side](double x, double y, double z) { return Eigen::Vector3d(x, side * y, z); };
    for (int i = 0; i < 12; ++i)
      world.movable.push_back(rod(at(0, 0.12, 0.07 * i), at(0, 0.12, 0.07 * i + 0.1), 0.07));
    for (int i = 0; i < 6; ++i) {
      const double t = i / 6.0;
      world.movable.push_back(rod(at(0.12 + 0.4 * t, 0.42 - 0.1 * t, 1.18 - 0.1 * t),
                                  at(0.18 + 0.4 * t, 0.40 - 0.1 * t, 1.16 - 0.1 * t), 0.05 - 0.02 * t));
    }
    for (int i = 0; i < 12; ++i) {
      const int column = i % 3, row = i / 3;
      const Eigen::Vector3d base = at(0.62 + 0.03 * column, 0.26 + 0.022 * row, 1.03 - 0.012 * column);
      world.movable.push_back(rod(base, base + Eigen::Vector3d(0.025, 0, -0.01), 0.009));
    }
  }
  for (int i = 0; i < 3; ++i)
    world.movable.push_back(rod({0, -0.1, 1.0 + 0.1 * i}, {0, 0.1, 1.0 + 0.1 * i}, 0.1));
  world.movable.push_back(rod({0.78, -0.5, 0.935}, {0.70, 0.5, 0.935}, 0.035));
  world.X_WC = look_at({0.12, 0.035, 1.66}, {0.80, 0, 0.92});
  return world;
}

const World& world_of(std::int64_t which) {
  static const World experiment = experiment_world();
  static const World dense = dense_world();
  return which == 0 ? experiment : dense;
}

double process_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// From the poses to the organized cloud that the client computes; every link moves from frame to frame.
void BM_StereoFrame(benchmark::State& state) {
  const World& world = world_of(state.range(0));
  RayScene scene;
  world.fill(scene);
  StereoOptions options;
  if (state.range(1) == 0) options = options.noise_free();
  options.threads = static_cast<int>(state.range(2));
  StereoCamera camera(options);
  const auto poses = world.two_poses();
  std::vector<float> disparity;
  walkman::sensors::StereoImages images;
  walkman::sensors::StereoImages* const wanted = state.range(3) == 0 ? nullptr : &images;
  walkman::multisense::Disparity image;
  image.width = static_cast<std::uint16_t>(options.width);
  image.height = static_cast<std::uint16_t>(options.height);
  const auto f = static_cast<float>(options.focal_px);
  const walkman::multisense::RectifiedProjection projection{
      f, f, static_cast<float>(options.cx), static_cast<float>(options.cy),
      static_cast<float>(options.focal_px * options.baseline)};
  walkman::camera::OrganizedCloud cloud;
  std::uint64_t frame = 0;
  const auto see = [&] {
    scene.update(poses[frame % 2]);
    camera.capture(scene, world.X_WC, 1, frame++, disparity, wanted);
    walkman::multisense::quantize(disparity, image.pixels);
    walkman::multisense::triangulate(image, projection, cloud);
    benchmark::DoNotOptimize(cloud.points.data());
  };
  see();  // builds tables and allocates
  for (auto _ : state) see();
  state.counters["triangles"] = static_cast<double>(scene.triangle_count());
}
BENCHMARK(BM_StereoFrame)
    ->ArgNames({"scene", "noise", "threads", "images"})
    ->ArgsProduct({{0, 1}, {0, 1}, {1, 2}, {0, 1}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

/// One turn of the laser's mirror; counter: share of a core at 40 turns per second, with the scene moved for
/// each.
void BM_LidarScan(benchmark::State& state) {
  constexpr double kRate = 40;
  const World& world = world_of(state.range(0));
  RayScene scene;
  world.fill(scene);
  walkman::sensors::SpinningLidar lidar({}, 1);
  const std::vector<Eigen::Isometry3d> poses = world.poses();
  walkman::sensors::LidarScan scan;
  std::uint64_t number = 0;
  const auto X_WL = [&](double seconds) {
    return Eigen::Isometry3d(world.X_WC * Eigen::AngleAxisd(5.2 * seconds, Eigen::Vector3d::UnitZ()));
  };
  scene.place(poses);
  lidar.scan(scene, X_WL, number++, scan);  // builds its tables
  const double start = process_seconds();
  for (auto _ : state) {
    if (state.range(1) != 0) scene.place(poses);
    lidar.scan(scene, X_WL, number++, scan);
  }
  state.counters["core-share"] =
      kRate * (process_seconds() - start) / static_cast<double>(state.iterations());
}
BENCHMARK(BM_LidarScan)
    ->ArgNames({"scene", "update"})
    ->ArgsProduct({{0, 1}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// Every link moves with each update.
void BM_SceneUpdate(benchmark::State& state) {
  const World& world = world_of(state.range(0));
  RayScene scene;
  world.fill(scene);
  const auto poses = world.two_poses();
  std::size_t moved = 0;
  for (auto _ : state) scene.update(poses[++moved % 2]);
}
BENCHMARK(BM_SceneUpdate)
    ->ArgName("scene")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

/// Casts the left image's rays in `world` with Embree: depth of each pixel, and the rays that a core casts
/// per second.
double cast_primary(const World& world, const StereoOptions& options, int repetitions,
                    std::vector<float>& depth) {
  RayScene scene;
  world.fill(scene);
  tbb::task_arena arena(1);
  StereoRays rays(options, 1);
  const auto stride = static_cast<std::size_t>(rays.stride()), bands = static_cast<std::size_t>(rays.bands());
  const std::size_t pixels = stride * bands * StereoRays::kBandRows;
  std::vector<float> disparity(pixels);
  std::vector<float> matched(pixels);
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repetitions; ++i) {
    const double start = process_seconds();
    rays.begin(scene, world.X_WC, arena, StereoRays::HiddenTest::kNone);
    walkman::sensors::run_jobs(
        arena, rays.bands(), [&](int band, int worker) { rays.cast_band(band, worker, disparity, matched); });
    best = std::min(best, process_seconds() - start);
  }
  depth = disparity;
  for (float& d : depth) d = static_cast<float>(options.focal_px * options.baseline) / d;
  return options.width * options.height / best;
}

/// The world as a Bullet user would set it up for ray tests: primitives as they are, and trees of triangles
/// for meshes.
class BulletWorld {
 public:
  explicit BulletWorld(const World& world) {
    for (const auto* bodies : {&world.fixed, &world.movable}) {
      for (const Body& body : *bodies) {
        for (const LinkGeometry& geometry : body.geometry) add(geometry, body.X_WL * geometry.X_LG);
      }
    }
    world_.updateAabbs();
  }
  ~BulletWorld() {
    for (const auto& object : objects_) world_.removeCollisionObject(object.get());
  }
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  /// Fraction of the way from `from` to `to`; infinity without a hit.
  [[nodiscard]] double cast(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    const btVector3 a(from.x(), from.y(), from.z());
    const btVector3 b(to.x(), to.y(), to.z());
    btCollisionWorld::ClosestRayResultCallback result(a, b);
    world_.rayTest(a, b, result);
    return result.hasHit() ? result.m_closestHitFraction : std::numeric_limits<double>::infinity();
  }

 private:
  void add(const LinkGeometry& geometry, const Eigen::Isometry3d& X_WG) {
    if (const auto* box = std::get_if<walkman::BoxShape>(&geometry.shape)) {
      const Eigen::Vector3d half = 0.5 * box->size;
      shapes_.push_back(std::make_unique<btBoxShape>(btVector3(half.x(), half.y(), half.z())));
    } else if (const auto* cylinder = std::get_if<walkman::CylinderShape>(&geometry.shape)) {
      shapes_.push_back(std::make_unique<btCylinderShapeZ>(
          btVector3(cylinder->radius, cylinder->radius, 0.5 * cylinder->length)));
    } else if (const auto* sphere = std::get_if<walkman::SphereShape>(&geometry.shape)) {
      shapes_.push_back(std::make_unique<btSphereShape>(sphere->radius));
    } else {
      const auto& mesh = std::get<walkman::MeshShape>(geometry.shape);
      auto triangles = std::make_unique<btTriangleMesh>();
      const auto corner = [&mesh](int i) {
        const Eigen::Vector3d& p = mesh.vertices[static_cast<std::size_t>(i)];
        return btVector3(p.x(), p.y(), p.z());
      };
      for (const Eigen::Vector3i& t : mesh.triangles)
        triangles->addTriangle(corner(t.x()), corner(t.y()), corner(t.z()));
      shapes_.push_back(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true));
      meshes_.push_back(std::move(triangles));
    }
    if (shapes_.back()->isConvex() && std::get_if<walkman::SphereShape>(&geometry.shape) == nullptr) {
      shapes_.back()->setMargin(0.001);
    }
    const Eigen::Quaterniond q(X_WG.linear());
    const Eigen::Vector3d& p = X_WG.translation();
    objects_.push_back(std::make_unique<btCollisionObject>());
    objects_.back()->setCollisionShape(shapes_.back().get());
    objects_.back()->setWorldTransform(
        btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()), btVector3(p.x(), p.y(), p.z())));
    world_.addCollisionObject(objects_.back().get());
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_{&dispatcher_, &broadphase_, &configuration_};
  std::vector<std::unique_ptr<btTriangleMesh>> meshes_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
};

void BM_EmbreePrimaryRays(benchmark::State& state) {
  const World& world = world_of(state.range(0));
  const StereoOptions options = StereoOptions().noise_free();
  std::vector<float> depth;
  double rate = 0;
  for (auto _ : state) rate = std::max(rate, cast_primary(world, options, 3, depth));
  state.counters["Mrays/core-s"] = 1e-6 * rate;
}
BENCHMARK(BM_EmbreePrimaryRays)
    ->ArgName("scene")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3);

/// One ray in 16, one thread. Counters: Bullet's rate, Embree's on the whole image, their ratio, and the
/// share of rays whose depths differ by more than 2 mm.
void BM_BulletRayTest(benchmark::State& state) {
  constexpr int kStep = 4;
  constexpr double kFar = 8;  // m of depth
  const World& world = world_of(state.range(0));
  const StereoOptions options = StereoOptions().noise_free();
  std::vector<float> depth;
  const double embree = cast_primary(world, options, 7, depth);

  const BulletWorld bullet(world);
  const Eigen::Vector3d& origin = world.X_WC.translation();
  std::size_t rays = 0;
  std::size_t differ = 0;
  const double start = process_seconds();
  for (auto _ : state) {
    for (int v = 0; v < options.height; v += kStep) {
      for (int u = 0; u < options.width; u += kStep) {
        const Eigen::Vector3d direction =
            world.X_WC.linear() *
            Eigen::Vector3d((u - options.cx) / options.focal_px, (v - options.cy) / options.focal_px, 1);
        const double fraction =
            bullet.cast(origin + options.min_depth * direction, origin + kFar * direction);
        const double z = options.min_depth + fraction * (kFar - options.min_depth);
        const int pixel = v * options.width + u;
        const float z_embree = depth[static_cast<std::size_t>(pixel)];
        const bool same =
            std::isfinite(z) ? std::abs(z - static_cast<double>(z_embree)) < 2e-3 : z_embree > kFar;
        differ += same ? 0 : 1;
        ++rays;
      }
    }
  }
  const double rate = static_cast<double>(rays) / (process_seconds() - start);
  state.counters["Mrays/core-s"] = 1e-6 * rate;
  state.counters["Embree_Mrays/core-s"] = 1e-6 * embree;
  state.counters["Embree_over_Bullet"] = embree / rate;
  state.counters["differ_2mm"] = static_cast<double>(differ) / static_cast<double>(rays);
}
BENCHMARK(BM_BulletRayTest)->ArgName("scene")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->MinTime(1);

}  // namespace
