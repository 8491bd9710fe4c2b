#include "apps/picture/scene_painting.h"

#include <array>

#include "emulator/plant/dynamics/world_objects.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr double kHeightAngle = 0.42;   // rad
constexpr double kSunBeside = -0.6;     // rad, the sun's azimuth relative to the camera's
constexpr double kSunElevation = 0.95;  // rad

using picture::Paint;

// Reflectances, linear.
const std::array<Paint, 6> kRobotPaints{Paint{{0.150F, 0.165F, 0.185F}, 0.10F, false},    // graphite
                                        Paint{{0.400F, 0.415F, 0.430F}, 0.12F, false},    // aluminium
                                        Paint{{0.085F, 0.150F, 0.235F}, 0.10F, false},    // slate blue
                                        Paint{{0.250F, 0.265F, 0.285F}, 0.12F, false},    // grey
                                        Paint{{0.300F, 0.060F, 0.050F}, 0.10F, false},    // oxide red
                                        Paint{{0.200F, 0.190F, 0.170F}, 0.10F, false}};   // warm grey
const std::array<Paint, 3> kObjectPaints{Paint{{0.640F, 0.360F, 0.090F}, 0.08F, false},   // ochre
                                         Paint{{0.060F, 0.062F, 0.066F}, 0.20F, false},   // steel
                                         Paint{{0.120F, 0.230F, 0.130F}, 0.08F, false}};  // green
const Paint kFurniture{{0.400F, 0.310F, 0.220F}, 0.03F, false};
const Paint kGround{{0.370F, 0.385F, 0.400F}, 0, true};

constexpr double kBelow = 0.01;  // m, how far above the robot's lowest point a ground may reach

/// Number of moving joints between each link and the root.
std::vector<std::size_t> depths(const RobotModel& model) {
  std::vector<std::size_t> depth(model.links.size(), 0);
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (model.links[i].parent_joint < 0) continue;
    const Joint& joint = model.joints[static_cast<std::size_t>(model.links[i].parent_joint)];
    depth[i] = depth[static_cast<std::size_t>(joint.parent_link)] + (joint.type == JointType::kFixed ? 0 : 1);
  }
  return depth;
}

/// Adds a body to the subject of the picture: the corners of the box around it along its own axes.
void show(const LinkGeometry& geometry, const Eigen::Isometry3d& X_WL, ScenePainting& painting) {
  LinkGeometry upright = geometry;
  upright.X_LG = Eigen::Isometry3d::Identity();
  const Eigen::AlignedBox3d box_G = picture::bounds_W({upright}, Eigen::Isometry3d::Identity());
  for (int i = 0; i < 8; ++i) {
    painting.subject_W.emplace_back(X_WL * geometry.X_LG *
                                    box_G.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  }
}

void paint_robot(const EmulatedWorld& world, const Snapshot& snapshot, ScenePainting& painting) {
  const std::vector<std::size_t> depth = depths(world.truth.model);
  for (std::size_t i = 0; i < world.truth.model.links.size(); ++i) {
    const std::vector<LinkGeometry>& visuals = world.truth.model.links[i].visuals;
    painting.bodies.add(visuals, snapshot.X_WL[i], kRobotPaints[depth[i] % kRobotPaints.size()]);
    for (const LinkGeometry& geometry : visuals) show(geometry, snapshot.X_WL[i], painting);
  }
}

void paint_objects(const Snapshot& snapshot, ScenePainting& painting) {
  for (std::size_t o = 0; o < snapshot.objects.size(); ++o) {
    const SceneObject& object = snapshot.objects[o];
    const RobotModel model = plant::with_weights(object);
    const std::vector<Eigen::Isometry3d> X_OL = link_poses(model, {});
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      const std::vector<LinkGeometry>& visuals = model.links[i].visuals;
      const Eigen::Isometry3d X_WL = snapshot.X_WO[o] * X_OL[i];
      const bool weight = i >= object.model.links.size();
      painting.bodies.add(visuals, X_WL, kObjectPaints[weight ? 1 : 2 * (o % 2)]);
      for (const LinkGeometry& geometry : visuals) show(geometry, X_WL, painting);
    }
  }
}

void paint_fixed(const FixedBody& body, const Eigen::AlignedBox3d& robot_W, ScenePainting& painting) {
  const std::vector<Eigen::Isometry3d> X_FL = link_poses(body.model, {});
  Eigen::AlignedBox3d all;
  for (std::size_t i = 0; i < X_FL.size(); ++i) {
    all.extend(picture::bounds_W(body.model.links[i].visuals, body.X_WF * X_FL[i]));
  }
  const bool surrounds = (all.min().head<2>().array() < robot_W.min().head<2>().array()).all() &&
                         (all.max().head<2>().array() > robot_W.max().head<2>().array()).all();
  for (std::size_t i = 0; i < X_FL.size(); ++i) {
    for (const LinkGeometry& geometry : body.model.links[i].visuals) {
      const Eigen::Isometry3d X_WL = body.X_WF * X_FL[i];
      const bool below = picture::bounds_W({geometry}, X_WL).max().z() <= robot_W.min().z() + kBelow;
      if (surrounds && !below) continue;
      painting.bodies.add({geometry}, X_WL, surrounds ? kGround : kFurniture);
      if (!surrounds) show(geometry, X_WL, painting);
    }
  }
}

picture::Lighting lighting_for(const ScenePainting& painting, double azimuth) {
  picture::Lighting lighting;
  const double sun = azimuth + kSunBeside;
  lighting.p_to_sun = Eigen::Vector3d(std::cos(kSunElevation) * std::cos(sun),
                                      std::cos(kSunElevation) * std::sin(sun), std::sin(kSunElevation))
                          .cast<float>();
  Eigen::AlignedBox3d subject_W;
  for (const Eigen::Vector3d& corner : painting.subject_W) subject_W.extend(corner);
  lighting.shadow_reach = static_cast<float>(2 * subject_W.diagonal().norm());
  lighting.ground_centre = subject_W.center().cast<float>();
  return lighting;
}

}  // namespace

void paint_scene(const EmulatedWorld& world, const Snapshot& snapshot, ScenePainting& painting) {
  paint_robot(world, snapshot, painting);
  Eigen::AlignedBox3d robot_W;
  for (const Eigen::Vector3d& corner : painting.subject_W) robot_W.extend(corner);
  paint_objects(snapshot, painting);
  for (const FixedBody& body : world.scene.fixed) paint_fixed(body, robot_W, painting);
}

picture::Picture portrait(const ScenePainting& painting, const PictureView& view) {
  const picture::PictureCamera camera = picture::camera_around(
      painting.subject_W, view.azimuth, view.elevation, kHeightAngle, view.width, view.height);
  return picture::render(painting.bodies, camera, lighting_for(painting, view.azimuth), view.samples,
                         view.threads);
}

}  // namespace walkman::apps
