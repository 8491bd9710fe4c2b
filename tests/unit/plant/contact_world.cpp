#include "tests/unit/plant/contact_world.h"

#include <cmath>
#include <numbers>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {
namespace {

/// Moments of inertia about the shape's axes, per kilogram, m².
struct UnitInertia {
  Eigen::Vector3d operator()(const BoxShape& box) const {
    const Eigen::Vector3d squares = box.size.cwiseAbs2();
    return (Eigen::Vector3d::Constant(squares.sum()) - squares) / 12;
  }
  Eigen::Vector3d operator()(const CylinderShape& c) const {
    const double across = (3 * c.radius * c.radius + c.length * c.length) / 12;
    return {across, across, c.radius * c.radius / 2};
  }
  Eigen::Vector3d operator()(const SphereShape& s) const {
    return Eigen::Vector3d::Constant(0.4 * s.radius * s.radius);
  }
  /// For a closed mesh about its centre, from tetrahedra with their apex there.
  Eigen::Vector3d operator()(const MeshShape& mesh) const {
    double volume = 0;
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3i& triangle : mesh.triangles) {
      Eigen::Matrix3d corners;
      for (int i = 0; i < 3; ++i) corners.row(i) = mesh.vertices[static_cast<std::size_t>(triangle[i])];
      const double tetrahedron = corners.determinant() / 6;
      const Eigen::Vector3d sum = corners.colwise().sum();
      const Eigen::Vector3d own = corners.cwiseAbs2().colwise().sum();
      squares += tetrahedron / 20 * (own + sum.cwiseAbs2());
      volume += tetrahedron;
    }
    return (Eigen::Vector3d::Constant(squares.sum()) - squares) / volume;
  }
};

RobotModel model_of(const Shape& shape, double mass, const Surface& surface) {
  RobotModel model;
  Link link;
  link.name = "solid";
  link.mass = mass;
  link.I_LLcm_L = (mass * std::visit(UnitInertia{}, shape)).asDiagonal();
  link.surface = surface;
  LinkGeometry geometry;
  geometry.shape = shape;
  link.collisions.push_back(geometry);
  model.links.push_back(link);
  return model;
}

}  // namespace

MeshShape prism(int sides, double radius, double length) {
  MeshShape mesh;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / sides;
    for (const double end : {-length / 2, length / 2})
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), end);
  }
  for (int i = 0; i < sides; ++i) {
    const int low = 2 * i, next = 2 * ((i + 1) % sides);
    mesh.triangles.emplace_back(low, next, next + 1);
    mesh.triangles.emplace_back(low, next + 1, low + 1);
    if (i == 0 || i == sides - 1) continue;
    mesh.triangles.emplace_back(0, next, low);
    mesh.triangles.emplace_back(1, low + 1, next + 1);
  }
  return mesh;
}

ContactWorld::ContactWorld() {
  world_.setGravity(btVector3(0, 0, -kGravity));
  world_.use_mid_step_velocities();
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = 50;
  info.m_erp2 = 0.2;
  info.m_globalCfm = 0;
  info.m_linearSlop = 1e-5;
}

void ContactWorld::add_fixed(const Shape& shape, const Eigen::Isometry3d& X_WF, const Surface& surface) {
  FixedBody body;
  body.name = "fixed";
  body.model = model_of(shape, 0, surface);
  body.X_WF = X_WF;
  fixed_.push_back(std::make_unique<StaticBody>(world_, body));
}

std::size_t ContactWorld::add(const Shape& shape, double mass, const Eigen::Isometry3d& X_WB,
                              const Surface& surface) {
  models_.push_back(std::make_unique<RobotModel>(model_of(shape, mass, surface)));
  bodies_.push_back(std::make_unique<Multibody>(world_, *models_.back(), RigidTree(*models_.back(), {}, {}),
                                                false, X_WB, kObjectGroup, kObjectGroup | kFixedGroup));
  return bodies_.size() - 1;
}

void ContactWorld::run(double seconds) {
  const long steps = std::lround(seconds / kStep);
  for (long i = 0; i < steps; ++i) step();
}

void ContactWorld::push(std::size_t body, const Eigen::Vector3d& force_W) {
  bodies_[body]->bullet().addBaseForce(to_bullet(force_W));
}

void ContactWorld::set_velocity(std::size_t body, const Eigen::Vector3d& v_WB) {
  bodies_[body]->bullet().setBaseVel(to_bullet(v_WB));
}

Eigen::Vector3d ContactWorld::v_WB(std::size_t body) const {
  return from_bullet(bodies_[body]->bullet().getBaseVel());
}

Eigen::Vector3d ContactWorld::w_WB(std::size_t body) const {
  return from_bullet(bodies_[body]->bullet().getBaseOmega());
}

double ContactWorld::energy(std::size_t body) const {
  const Link& link = models_[body]->links.front();
  const Eigen::Isometry3d X = X_WB(body);
  const Eigen::Vector3d w_B = X.linear().transpose() * w_WB(body);
  return link.mass * (kGravity * X.translation().z() + v_WB(body).squaredNorm() / 2) +
         w_B.dot(link.I_LLcm_L * w_B) / 2;
}

int ContactWorld::contacts() {
  int count = 0;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k)
      count += manifold.getContactPoint(k).getAppliedImpulse() > 0 ? 1 : 0;
  }
  return count;
}

}  // namespace walkman::plant
