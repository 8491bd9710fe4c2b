#include "sensors/ray_scene.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>

#include <embree3/rtcore.h>
#include <oneapi/tbb/task_arena.h>

#include "sensors/ray_scene_access.h"
#include "sensors/triangulation.h"

namespace walkman::sensors {
namespace {

void check_device(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) {
    throw std::runtime_error(std::string("Embree: error ") + std::to_string(error) + " while " + doing);
  }
}

/// Builds a tree in the calling thread alone, so that it is the same every time. A device with "threads=1"
/// would do so, too, but would leave the whole process without a second TBB worker.
void commit(RTCScene scene) {
  tbb::task_arena alone(1);
  alone.execute([scene] { rtcCommitScene(scene); });
}

/// Appends all of `geometry`, or nothing if one of its shapes is rejected.
void append_all(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_FL,
                TriangleMesh& mesh) {
  const std::size_t vertices = mesh.vertices.size();
  const std::size_t triangles = mesh.triangles.size();
  try {
    for (const LinkGeometry& g : geometry) append_triangles(g, X_FL, mesh);
  } catch (const std::invalid_argument&) {
    mesh.vertices.resize(vertices);
    mesh.triangles.resize(triangles);
    throw;
  }
}

}  // namespace

/// Bodies with their own trees, each of which moves as a whole.
class RayInstances {
 public:
  explicit RayInstances(RTCDevice device) : device_(device), scene_(rtcNewScene(device)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
  }
  ~RayInstances() {
    for (RTCGeometry instance : instances_)
      if (instance != nullptr) rtcReleaseGeometry(instance);
    rtcReleaseScene(scene_);
  }
  RayInstances(const RayInstances&) = delete;
  RayInstances& operator=(const RayInstances&) = delete;

  /// Adds the triangles from `first_triangle` up to, but not including, `end_triangle`, whose vertices begin
  /// at `first_vertex`.
  void add(const TriangleMesh& mesh, std::size_t first_triangle, std::size_t end_triangle,
           std::size_t first_vertex, std::size_t end_vertex) {
    RTCGeometry instance = nullptr;
    if (first_triangle < end_triangle) {
      RTCScene body = rtcNewScene(device_);
      attach(body, mesh, first_triangle, end_triangle, first_vertex, end_vertex, 0);
      commit(body);
      instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(instance, body);
      rtcReleaseScene(body);
      rtcAttachGeometryByID(scene_, instance,
                            RaySceneAccess::kMovable + static_cast<unsigned>(instances_.size()));
    }
    instances_.push_back(instance);
  }
  void add_fixed(const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) return;
    attach(scene_, mesh, 0, mesh.triangles.size(), 0, mesh.vertices.size(), RaySceneAccess::kFixed);
  }
  void place(std::span<const Eigen::Isometry3d> poses) {
    poses_.assign(poses.begin(), poses.end());
    for (std::size_t i = 0; i < instances_.size(); ++i) {
      if (instances_[i] == nullptr) continue;
      const Eigen::Matrix<float, 3, 4> X = poses[i].matrix().topRows<3>().cast<float>();
      rtcSetGeometryTransform(instances_[i], 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, X.data());
      rtcCommitGeometry(instances_[i]);
    }
    commit(scene_);
  }

  [[nodiscard]] RTCScene scene() const { return scene_; }
  [[nodiscard]] std::span<const Eigen::Isometry3d> poses() const { return poses_; }

 private:
  void attach(RTCScene scene, const TriangleMesh& mesh, std::size_t first_triangle, std::size_t end_triangle,
              std::size_t first_vertex, std::size_t end_vertex, unsigned number) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices =
        static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                    3 * sizeof(float), end_vertex - first_vertex));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(mesh.triangles[0]), end_triangle - first_triangle));
    check_device(device_, "allocating triangles");
    for (std::size_t i = first_vertex; i < end_vertex; ++i)
      vertices = std::copy(mesh.vertices[i].begin(), mesh.vertices[i].end(), vertices);
    for (std::size_t i = first_triangle; i < end_triangle; ++i)
      for (const std::uint32_t corner : mesh.triangles[i])
        *indices++ = corner - static_cast<std::uint32_t>(first_vertex);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, number);
    rtcReleaseGeometry(geometry);
  }

  RTCDevice device_;
  RTCScene scene_;
  std::vector<RTCGeometry> instances_;  // of each movable body; null for one without triangles
  std::vector<Eigen::Isometry3d> poses_;
};

struct RayScene::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry movable_geometry = nullptr;
  TriangleMesh fixed;                                 // vertices in W
  TriangleMesh movable;                               // vertices in their body's frame
  std::vector<std::size_t> first_vertex{0};           // of each movable body, and the end
  std::vector<std::size_t> fixed_ends, movable_ends;  // after each body's triangles
  std::vector<Eigen::Isometry3d> poses;               // of the movable bodies
  float* movable_vertices_W = nullptr;                // Embree's buffer
  std::unique_ptr<RayInstances> instances;
  bool built = false;
  std::mutex build_mutex;

  Impl() : device(rtcNewDevice(nullptr)) {
    if (device == nullptr) check_device(nullptr, "starting");
    scene = rtcNewScene(device);
    // This pair of settings makes Embree keep one tree per geometry with its own quality, under a small top
    // tree.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
    check_device(device, "creating a scene");
  }
  ~Impl() {
    instances.reset();
    if (movable_geometry != nullptr) rtcReleaseGeometry(movable_geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] std::size_t bodies() const { return first_vertex.size() - 1; }

  void require_not_built() const {
    if (built) throw std::logic_error("RayScene: geometry added after the scene was built");
  }

  void require_fit(std::span<const Eigen::Isometry3d> new_poses) const {
    if (new_poses.size() != bodies()) {
      throw std::invalid_argument("RayScene: " + std::to_string(new_poses.size()) +
                                  " poses given, expected " + std::to_string(bodies()) +
                                  ", one per movable body");
    }
    for (std::size_t i = 0; i < new_poses.size(); ++i) {
      if (!new_poses[i].matrix().allFinite()) {
        throw std::invalid_argument("RayScene: the pose of body " + std::to_string(i) + " is not finite");
      }
    }
  }

  RTCGeometry attach(const TriangleMesh& mesh, RTCBuildQuality quality, unsigned number, float** vertices) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    *vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
    check_device(device, "allocating triangles");
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcAttachGeometryByID(scene, geometry, number);
    return geometry;
  }

  void pose_movable(std::span<const Eigen::Isometry3d> new_poses) {
    poses.assign(new_poses.begin(), new_poses.end());
    for (std::size_t body = 0; body < bodies(); ++body) {
      const Eigen::Matrix3f R = poses[body].linear().cast<float>();
      const Eigen::Vector3f p = poses[body].translation().cast<float>();
      for (std::size_t i = first_vertex[body]; i < first_vertex[body + 1]; ++i) {
        Eigen::Map<Eigen::Vector3f>(movable_vertices_W + 3 * i) = R * movable.vertices[i] + p;
      }
    }
  }

  void build(std::span<const Eigen::Isometry3d> new_poses) {
    if (!fixed.triangles.empty()) {
      float* vertices = nullptr;
      RTCGeometry geometry = attach(fixed, RTC_BUILD_QUALITY_HIGH, RaySceneAccess::kFixed, &vertices);
      for (const Eigen::Vector3f& p : fixed.vertices) vertices = std::copy(p.begin(), p.end(), vertices);
      rtcCommitGeometry(geometry);
      rtcReleaseGeometry(geometry);
    }
    if (!movable.triangles.empty()) {
      movable_geometry =
          attach(movable, RTC_BUILD_QUALITY_REFIT, RaySceneAccess::kMovable, &movable_vertices_W);
      pose_movable(new_poses);
      rtcCommitGeometry(movable_geometry);
    }
    commit(scene);
    check_device(device, "building the scene");
    built = true;
  }
};

RayScene::RayScene() : impl_(std::make_unique<Impl>()) {}
RayScene::~RayScene() = default;

void RayScene::add_fixed(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_WL) {
  impl_->require_not_built();
  append_all(geometry, X_WL, impl_->fixed);
  impl_->fixed_ends.push_back(impl_->fixed.triangles.size());
}

BodyId RayScene::add_movable(const std::vector<LinkGeometry>& geometry) {
  impl_->require_not_built();
  append_all(geometry, Eigen::Isometry3d::Identity(), impl_->movable);
  impl_->first_vertex.push_back(impl_->movable.vertices.size());
  impl_->movable_ends.push_back(impl_->movable.triangles.size());
  return static_cast<BodyId>(impl_->bodies()) - 1;
}

void RayScene::place(std::span<const Eigen::Isometry3d> poses) {
  Impl& impl = *impl_;
  impl.require_fit(poses);
  if (impl.instances == nullptr) {
    impl.instances = std::make_unique<RayInstances>(impl.device);
    impl.instances->add_fixed(impl.fixed);
    std::size_t first_triangle = 0;
    for (std::size_t i = 0; i < impl.bodies(); ++i) {
      impl.instances->add(impl.movable, first_triangle, impl.movable_ends[i], impl.first_vertex[i],
                          impl.first_vertex[i + 1]);
      first_triangle = impl.movable_ends[i];
    }
  }
  impl.instances->place(poses);
  check_device(impl.device, "moving instances");
}

void RayScene::update(std::span<const Eigen::Isometry3d> poses) {
  impl_->require_fit(poses);
  if (!impl_->built) return impl_->build(poses);
  if (impl_->movable_geometry == nullptr) return;
  impl_->pose_movable(poses);
  rtcUpdateGeometryBuffer(impl_->movable_geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(impl_->movable_geometry);
  // A refit changes only the boxes of a tree that exists: they are the same whichever threads compute them.
  rtcCommitScene(impl_->scene);
  check_device(impl_->device, "refitting the scene");
}

std::size_t RayScene::triangle_count() const {
  return impl_->fixed.triangles.size() + impl_->movable.triangles.size();
}

RTCSceneTy* RaySceneAccess::embree_scene(const RayScene& scene) {
  RayScene::Impl& impl = *scene.impl_;
  const std::lock_guard lock(impl.build_mutex);
  if (!impl.built) {
    if (impl.bodies() > 0) throw std::logic_error("RayScene: used before its movable bodies had poses");
    impl.build({});
  }
  return impl.scene;
}

std::array<TriangleView, 2> RaySceneAccess::triangles(const RayScene& scene) {
  const RayScene::Impl& impl = *scene.impl_;
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const float* fixed = impl.fixed.vertices.empty() ? nullptr : impl.fixed.vertices.front().data();
  return {TriangleView{{fixed, 3 * impl.fixed.vertices.size()}, impl.fixed.triangles, impl.fixed_ends},
          TriangleView{{impl.movable_vertices_W,
                        impl.movable_vertices_W == nullptr ? 0 : 3 * impl.movable.vertices.size()},
                       impl.movable.triangles,
                       impl.movable_ends}};
}

RTCSceneTy* RaySceneAccess::placed_scene(const RayScene& scene) {
  return scene.impl_->instances == nullptr ? nullptr : scene.impl_->instances->scene();
}

std::span<const Eigen::Isometry3d> RaySceneAccess::placed_poses(const RayScene& scene) {
  if (scene.impl_->instances == nullptr) return {};
  return scene.impl_->instances->poses();
}

std::span<const Eigen::Isometry3d> RaySceneAccess::poses(const RayScene& scene) { return scene.impl_->poses; }

}  // namespace walkman::sensors
