#include "apps/experiment/least_torque.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "adaptation/motion/stance.h"
#include "adaptation/regrasp/grasp_planner.h"
#include "adaptation/regrasp/observer.h"
#include "adaptation/regrasp/surroundings.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "urdf/reader/extent.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr double kGravity = 9.81;     // m/s²
constexpr double kGrid = 0.006;       // m between points of a surface
constexpr double kPlace = 0.01;       // m between places on a handle
constexpr double kLevel = 0.7;        // sine of the largest slope of a handle's axis
constexpr double kTableTop = 0.01;    // m, largest distance of a supporting face from an object's lowest
                                      // point
constexpr double kOnePlane = 0.9998;  // cosine of a degree

/// Points on the surface of a collision shape, in its frame.
std::vector<Eigen::Vector3d> surface(const LinkGeometry& geometry) {
  std::vector<Eigen::Vector3d> points;
  const auto steps = [](double length) { return std::max(1, static_cast<int>(std::ceil(length / kGrid))); };
  if (const auto* cylinder = std::get_if<CylinderShape>(&geometry.shape)) {
    const int round = steps(2 * std::numbers::pi * cylinder->radius), along = steps(cylinder->length);
    const int across = steps(cylinder->radius);
    for (int i = 0; i < round; ++i) {
      const double angle = 2 * std::numbers::pi * i / round;
      const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
      for (int k = 0; k <= along; ++k)
        points.push_back(cylinder->radius * out + (static_cast<double>(k) / along - 0.5) * cylinder->length *
                                                      Eigen::Vector3d::UnitZ());
      for (int k = 0; k < across; ++k)
        for (const double end : {-0.5, 0.5})
          points.push_back(cylinder->radius * k / across * out +
                           end * cylinder->length * Eigen::Vector3d::UnitZ());
    }
  } else if (const auto* box = std::get_if<BoxShape>(&geometry.shape)) {
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int i = 0; i <= steps(box->size[u]); ++i)
        for (int k = 0; k <= steps(box->size[v]); ++k)
          for (const double end : {-0.5, 0.5}) {
            Eigen::Vector3d p;
            p[axis] = end * box->size[axis];
            p[u] = (static_cast<double>(i) / steps(box->size[u]) - 0.5) * box->size[u];
            p[v] = (static_cast<double>(k) / steps(box->size[v]) - 0.5) * box->size[v];
            points.push_back(p);
          }
    }
  } else if (const auto* sphere = std::get_if<SphereShape>(&geometry.shape)) {
    const int rings = steps(std::numbers::pi * sphere->radius);
    for (int i = 0; i <= rings; ++i)
      for (int k = 0; k < 2 * rings; ++k) {
        const double up = std::numbers::pi * i / rings, round = std::numbers::pi * k / rings;
        points.push_back(sphere->radius * Eigen::Vector3d(std::sin(up) * std::cos(round),
                                                          std::sin(up) * std::sin(round), std::cos(up)));
      }
  } else if (const auto* mesh = std::get_if<MeshShape>(&geometry.shape)) {
    points = mesh->vertices;
  }
  return points;
}

/// Returns the shape as a handle if it is a cylinder that a hand can enclose.
std::optional<perception::Handle> handle_of(const LinkGeometry& geometry, const Eigen::Isometry3d& X_TG,
                                            const StageOneParameters& parameters) {
  const auto* cylinder = std::get_if<CylinderShape>(&geometry.shape);
  if (cylinder == nullptr || cylinder->radius < parameters.handle_min_radius ||
      cylinder->radius > parameters.handle_max_radius)
    return std::nullopt;
  perception::Handle handle;
  handle.p_CM = X_TG.translation();
  handle.axis_C = X_TG.linear().col(2);
  if (handle.axis_C.y() > 0) handle.axis_C = -handle.axis_C;  // points to the right
  if (std::abs(handle.axis_C.z()) > kLevel) return std::nullopt;
  handle.radius = cylinder->radius;
  handle.to = cylinder->length / 2;
  handle.from = -handle.to;
  handle.reach = kPlace;
  const int places = static_cast<int>(handle.to / kPlace);
  for (int place = -places; place <= places; ++place) handle.places.push_back(place * kPlace);
  return handle;
}

/// The surface on which an object stands.
struct Top {
  Eigen::Vector3d n_T = Eigen::Vector3d::UnitZ();  ///< up
  std::vector<Eigen::Vector3d> corners_T;
};

double lowest_along(const Eigen::Vector3d& n_T, const std::vector<Eigen::Vector3d>& points_T) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p : points_T) lowest = std::min(lowest, n_T.dot(p));
  return lowest;
}

/// The upper faces of fixed bodies' boxes that lie at an object's lowest points, in one plane.
Top top_under(const Scene& scene, const Eigen::Isometry3d& X_TW,
              const std::vector<Eigen::Vector3d>& object_T) {
  std::vector<Top> faces;
  Top top;
  double nearest = kTableTop;
  for (const FixedBody& body : scene.fixed) {
    const std::vector<Eigen::Isometry3d> X_FL = link_poses(body.model, {});
    for (std::size_t i = 0; i < X_FL.size(); ++i)
      for (const LinkGeometry& geometry : body.model.links[i].collisions) {
        const auto* box = std::get_if<BoxShape>(&geometry.shape);
        if (box == nullptr) continue;
        const Eigen::Isometry3d X_TG = X_TW * body.X_WF * X_FL[i] * geometry.X_LG;
        int axis = 0;
        X_TG.linear().row(2).cwiseAbs().maxCoeff(&axis);
        const double side = X_TG.linear()(2, axis) < 0 ? -0.5 : 0.5;
        Top face{2 * side * X_TG.linear().col(axis), {}};
        for (const double u : {-0.5, 0.5})
          for (const double v : {-0.5, 0.5}) {
            Eigen::Vector3d p_G;
            p_G[axis] = side * box->size[axis];
            p_G[(axis + 1) % 3] = u * box->size[(axis + 1) % 3];
            p_G[(axis + 2) % 3] = v * box->size[(axis + 2) % 3];
            face.corners_T.emplace_back(X_TG * p_G);
          }
        const double gap = std::abs(lowest_along(face.n_T, object_T) - face.n_T.dot(face.corners_T.front()));
        if (gap > kTableTop) continue;
        if (gap < nearest) top.n_T = face.n_T;
        nearest = std::min(nearest, gap);
        faces.push_back(std::move(face));
      }
  }
  for (const Top& face : faces)
    if (face.n_T.dot(top.n_T) > kOnePlane)
      top.corners_T.insert(top.corners_T.end(), face.corners_T.begin(), face.corners_T.end());
  return top;
}

}  // namespace

std::optional<double> least_torque(const Scene& scene, const SceneObject& object, const KnownRobot& robot,
                                   const std::vector<std::string>& joint_names,
                                   const MethodParameters& parameters) {
  // T is the initial frame of the robot's base; C coincides with it.
  const Eigen::Isometry3d X_TW = scene.X_WB.inverse();
  const std::map<std::string, double> posture =
      load_posture(robot.description.srdf, scene.posture, robot.model);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(joint_names.size()));
  for (std::size_t i = 0; i < joint_names.size(); ++i)
    if (const auto found = posture.find(joint_names[i]); found != posture.end())
      q[static_cast<Eigen::Index>(i)] = found->second;
  motion::KinematicTree posed(robot.model, joint_names);
  posed.update(q);
  std::optional<motion::Stance> stance;
  if (robot.description.stance && scene.base != BaseKind::kFixed) {
    stance.emplace(robot.model);
    stance->take(posed);
  }

  perception::StageOneResult seen;
  seen.objects.assign(1, {});
  perception::SeenObject& shape = seen.objects.front();
  const RobotModel whole = plant::with_weights(object);
  const std::vector<Eigen::Isometry3d> X_OL = link_poses(whole, {});
  std::vector<Eigen::Vector3d> object_T;
  for (std::size_t i = 0; i < whole.links.size(); ++i) {
    for (const LinkGeometry& geometry : whole.links[i].collisions) {
      const Eigen::Isometry3d X_TG = X_TW * object.X_WO * X_OL[i] * geometry.X_LG;
      for (const Eigen::Vector3d& p_G : surface(geometry)) {
        object_T.emplace_back(X_TG * p_G);
        shape.surface_C.push_back(object_T.back().cast<float>());
      }
      if (const auto handle = handle_of(geometry, X_TG, parameters.stage_one))
        shape.handles.push_back(*handle);
    }
  }
  if (shape.handles.empty()) return std::nullopt;
  const Top top = top_under(scene, X_TW, object_T);
  seen.plane.n_C = top.n_T;
  seen.plane.offset = -lowest_along(top.n_T, object_T);
  std::vector<motion::NamedObstacle> obstacles;
  if (!top.corners_T.empty())
    obstacles = regrasp::surroundings(seen, top.corners_T, Eigen::Isometry3d::Identity());

  const Eigen::Vector3d p_TCm = X_TW * object.X_WO * object.p_OOcm();
  regrasp::GraspPlanner planner(robot, joint_names, stance, parameters);
  try {
    const regrasp::PlannedGrasp grasp = planner.plan(
        {&seen, Eigen::Isometry3d::Identity(), obstacles, q, q},
        [&](const perception::Handle& handle, double along) {
          const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() - handle.axis_C.z() * handle.axis_C;
          const Eigen::Vector3d palm = handle.p_CM + along * handle.axis_C + handle.radius * up.normalized();
          return (palm - p_TCm).head<2>().norm();
        });
    return grasp.cost * object.mass() * kGravity;
  } catch (const regrasp::RunStopped&) {
    return std::nullopt;
  }
}

}  // namespace walkman::apps
