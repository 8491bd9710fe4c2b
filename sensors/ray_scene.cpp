#include "sensors/ray_scene.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>

#include <embree3/rtcore.h>

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

/// All of `geometry` or, when a shape of it is refused, nothing.
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

struct RayScene::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry movable_geometry = nullptr;
  TriangleMesh fixed;                                 // vertices in W
  TriangleMesh movable;                               // vertices in their body's frame
  std::vector<std::size_t> first_vertex{0};           // of each movable body, and the end
  std::vector<std::size_t> fixed_ends, movable_ends;  // behind each body's triangles
  std::vector<Eigen::Isometry3d> poses;               // of the movable bodies
  float* movable_vertices_W = nullptr;                // Embree's buffer
  bool built = false;
  std::mutex build_mutex;

  Impl() : device(rtcNewDevice("threads=1")) {
    if (device == nullptr) check_device(nullptr, "starting");
    scene = rtcNewScene(device);
    // This pair of settings makes Embree keep one tree per geometry with its own quality, under a small top
    // tree.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
    check_device(device, "creating a scene");
  }
  ~Impl() {
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
    rtcCommitScene(scene);
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

void RayScene::update(std::span<const Eigen::Isometry3d> poses) {
  if (poses.size() != impl_->bodies()) {
    throw std::invalid_argument("RayScene: " + std::to_string(poses.size()) + " poses given, expected " +
                                std::to_string(impl_->bodies()) + ", one a movable body");
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i].matrix().allFinite()) {
      throw std::invalid_argument("RayScene: the pose of body " + std::to_string(i) + " is not finite");
    }
  }
  if (!impl_->built) return impl_->build(poses);
  if (impl_->movable_geometry == nullptr) return;
  impl_->pose_movable(poses);
  rtcUpdateGeometryBuffer(impl_->movable_geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(impl_->movable_geometry);
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

std::span<const Eigen::Isometry3d> RaySceneAccess::poses(const RayScene& scene) { return scene.impl_->poses; }

}  // namespace walkman::sensors
