#include "emulator/plant/dynamics/self_collision.h"

#include <memory>

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletCollisionCommon.h>

#include "emulator/plant/contact/bullet_types.h"
#include "emulator/plant/contact/collider_parts.h"
#include "urdf/reader/kinematics.h"

namespace walkman::plant {
namespace {

constexpr double kTouching = 1e-3;       // m
constexpr double kCompoundJoint = 0.10;  // m, largest distance between the origins of its two axes

/// The groups' shapes in a collision world of their own.
class ShapesAtRest {
 public:
  ShapesAtRest(const RobotModel& model, const RigidTree& tree) : tree_(tree) {
    for (const RigidBodyGroup& group : tree.groups()) {
      auto compound = std::make_unique<btCompoundShape>();
      for (const int link : group.links) {
        for (const Solid& solid : solids_of(model.links[static_cast<std::size_t>(link)].collisions)) {
          parts_.push_back(make_shape(solid));
          compound->addChildShape(to_bullet(Eigen::Isometry3d(tree.X_ML(link) * solid.X_LC)),
                                  parts_.back().get());
        }
      }
      auto object = std::make_unique<btCollisionObject>();
      object->setCollisionShape(compound.get());
      bodies_.push_back(std::move(object));
      compounds_.push_back(std::move(compound));
    }
  }
  [[nodiscard]] bool has_shape(std::size_t group) const { return compounds_[group]->getNumChildShapes() > 0; }
  void pose(const std::vector<Eigen::Isometry3d>& X_RL) {
    for (std::size_t g = 0; g < bodies_.size(); ++g) {
      const int root = tree_.groups()[g].root_link;
      bodies_[g]->setWorldTransform(
          to_bullet(Eigen::Isometry3d(X_RL[static_cast<std::size_t>(root)] * tree_.X_ML(root).inverse())));
    }
  }
  [[nodiscard]] bool touch(std::size_t a, std::size_t b) {
    struct Touch : btCollisionWorld::ContactResultCallback {
      bool found = false;
      btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* /*a*/, int /*part*/,
                               int /*index*/, const btCollisionObjectWrapper* /*b*/, int /*part*/,
                               int /*index*/) override {
        found = found || point.getDistance() <= kTouching;
        return 0;
      }
    } touch;
    touch.m_closestDistanceThreshold = kTouching;
    world_.contactPairTest(bodies_[a].get(), bodies_[b].get(), touch);
    return touch.found;
  }

 private:
  const RigidTree& tree_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_{&dispatcher_, &broadphase_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> parts_;
  std::vector<std::unique_ptr<btCompoundShape>> compounds_;
  std::vector<std::unique_ptr<btCollisionObject>> bodies_;
};

/// For each group, the cut it hangs below (a group carried by a joint that stays rigid), or −1.
std::vector<int> hands_of(const RigidTree& tree) {
  std::vector<int> hands;
  for (std::size_t g = 0; g < tree.groups().size(); ++g) {
    const RigidBodyGroup& group = tree.groups()[g];
    const bool cut = group.joint >= 0 && !group.moves;
    hands.push_back(cut                ? static_cast<int>(g)
                    : group.parent < 0 ? -1
                                       : hands[static_cast<std::size_t>(group.parent)]);
  }
  return hands;
}

/// Whether `upper` carries a body that carries `lower`, through two joints close together.
bool joined_by_compound(const RobotModel& model, const RigidTree& tree, std::size_t upper,
                        std::size_t lower) {
  const int between = tree.groups()[lower].parent;
  if (between < 0) return false;
  // A palm mounted on its sensor belongs to the wrist.
  if (!tree.groups()[lower].moves) {
    const auto wrist = static_cast<std::size_t>(between);
    return tree.groups()[wrist].parent == static_cast<int>(upper) ||
           joined_by_compound(model, tree, upper, wrist);
  }
  const RigidBodyGroup& middle = tree.groups()[static_cast<std::size_t>(between)];
  if (middle.parent != static_cast<int>(upper)) return false;
  // Both joints' origins in the middle body's frame: that of its carrying joint and that of the joint it
  // carries.
  const Joint& carried = model.joints[static_cast<std::size_t>(tree.groups()[lower].joint)];
  const Eigen::Vector3d p_M1 = tree.X_ML(middle.root_link).translation();
  const Eigen::Vector3d p_M2 = (tree.X_ML(carried.parent_link) * carried.X_PJ).translation();
  return (p_M2 - p_M1).norm() < kCompoundJoint;
}

}  // namespace

const char* to_string(Excuse excuse) {
  switch (excuse) {
    case Excuse::kAdjacent:
      return "adjacent";
    case Excuse::kCompoundJoint:
      return "compound joint";
    case Excuse::kSameHand:
      return "same hand";
    case Excuse::kTouchesAtZero:
      return "touch at zero";
    case Excuse::kTouchesAtStart:
      return "touch at start";
    case Excuse::kNone:
      break;
  }
  return "collide";
}

void SelfCollision::excuse(int a, int b, Excuse why) {
  table_[static_cast<std::size_t>(a) * count_ + static_cast<std::size_t>(b)] = why;
  table_[static_cast<std::size_t>(b) * count_ + static_cast<std::size_t>(a)] = why;
}

SelfCollision::SelfCollision(const RobotModel& model, const RigidTree& tree,
                             const std::map<std::string, double>& start)
    : count_(tree.groups().size()), table_(count_ * count_, Excuse::kNone) {
  ShapesAtRest shapes(model, tree);
  const std::vector<int> hands = hands_of(tree);
  const auto each_undecided = [&](const auto& decide) {
    for (std::size_t a = 0; a < count_; ++a) {
      for (std::size_t b = a + 1; b < count_; ++b) {
        const int group_a = static_cast<int>(a);
        const int group_b = static_cast<int>(b);
        if (!shapes.has_shape(a) || !shapes.has_shape(b)) continue;
        if (excuse(group_a, group_b) == Excuse::kNone) excuse(group_a, group_b, decide(a, b));
      }
    }
  };
  each_undecided([&](std::size_t a, std::size_t b) {
    if (tree.groups()[b].parent == static_cast<int>(a)) return Excuse::kAdjacent;
    if (joined_by_compound(model, tree, a, b)) return Excuse::kCompoundJoint;
    return hands[a] >= 0 && hands[a] == hands[b] ? Excuse::kSameHand : Excuse::kNone;
  });
  shapes.pose(link_poses(model, {}));
  each_undecided([&](std::size_t a, std::size_t b) {
    return shapes.touch(a, b) ? Excuse::kTouchesAtZero : Excuse::kNone;
  });
  shapes.pose(link_poses(model, start));
  each_undecided([&](std::size_t a, std::size_t b) {
    return shapes.touch(a, b) ? Excuse::kTouchesAtStart : Excuse::kNone;
  });
  for (std::size_t a = 0; a < count_; ++a) {
    for (std::size_t b = a + 1; b < count_; ++b) {
      const Excuse why = excuse(static_cast<int>(a), static_cast<int>(b));
      if (why != Excuse::kNone) excused_.push_back({static_cast<int>(a), static_cast<int>(b), why});
    }
  }
}

bool SelfCollisionFilter::needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const {
  if ((a->m_collisionFilterGroup & b->m_collisionFilterMask) == 0 ||
      (b->m_collisionFilterGroup & a->m_collisionFilterMask) == 0) {
    return false;
  }
  const auto* link_a =
      btMultiBodyLinkCollider::upcast(static_cast<const btCollisionObject*>(a->m_clientObject));
  const auto* link_b =
      btMultiBodyLinkCollider::upcast(static_cast<const btCollisionObject*>(b->m_clientObject));
  if (link_a == nullptr || link_b == nullptr || link_a->m_multiBody != link_b->m_multiBody) return true;
  return table_->excuse(link_a->m_link + 1, link_b->m_link + 1) == Excuse::kNone;
}

}  // namespace walkman::plant
