#include "emulator/plant/contact/contact_dispatcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>

#include "emulator/plant/contact/collider_parts.h"
#include "emulator/plant/contact/primitive.h"

namespace walkman::plant {
namespace {

// m; surfaces farther apart cannot meet within a step at 1 m/s, and give no row to solve.
constexpr double kReach = 0.001;
// m that a contact may move over a surface from step to step and still count as the same: 5 m/s.
constexpr double kSamePoint = 0.005;
// m by which two bodies are still apart when they are checked again: more than the rounding errors of their
// poses.
constexpr double kSlack = 1e-6;

/// The contacts of two solids. A manifold holds up to four.
struct Meeting {
  std::size_t part_a, part_b;
  std::array<btPersistentManifold*, Touches::kMost / MANIFOLD_CACHE_SIZE> manifolds{};
  btCollisionAlgorithm* bullets = nullptr;  // where no closed form is known
  std::array<Stick, Touches::kMost> sticks;

  [[nodiscard]] int count() const {
    int sum = 0;
    for (const btPersistentManifold* manifold : manifolds)
      if (manifold != nullptr) sum += manifold->getNumContacts();
    return sum;
  }
  void set_count(int count) {
    for (btPersistentManifold* manifold : manifolds) {
      if (manifold == nullptr) continue;
      manifold->setNumContacts(std::min(count, MANIFOLD_CACHE_SIZE));
      count -= manifold->getNumContacts();
    }
  }
  [[nodiscard]] btManifoldPoint& point(int i) {
    return manifolds[static_cast<std::size_t>(i / MANIFOLD_CACHE_SIZE)]->getContactPoint(i %
                                                                                         MANIFOLD_CACHE_SIZE);
  }
};

void describe(btManifoldPoint& point, const Surface& pair) {
  point.m_combinedFriction = pair.friction;
  point.m_combinedRollingFriction = pair.rolling_friction;
  point.m_combinedSpinningFriction = pair.spinning_friction;
  point.m_combinedRestitution = pair.restitution;
  if (pair.stiffness <= 0) return;
  point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
  point.m_combinedContactStiffness1 = pair.stiffness;
  point.m_combinedContactDamping1 = pair.damping;
}

const btConvexPolyhedron* hull_of(const ColliderPart& part) {
  return static_cast<const btPolyhedralConvexShape*>(part.shape)->getConvexPolyhedron();
}

bool is_flat(const ColliderPart& part) {
  return !part.primitive || part.primitive->kind == Primitive::Kind::kBox;
}

/// Puts the touches into the manifold. Each inherits the Stick of the old point nearest to it on either
/// surface.
void renew(Meeting& meeting, const Touches& touches, const Surface& pair) {
  const btTransform& X_WA = meeting.manifolds[0]->getBody0()->getWorldTransform();
  const btTransform& X_WB = meeting.manifolds[0]->getBody1()->getWorldTransform();
  const int old_count = meeting.count();
  std::array<btVector3, Touches::kMost> old_a, old_b;
  std::array<bool, Touches::kMost> taken{};
  const std::array<Stick, Touches::kMost> old_sticks = meeting.sticks;
  for (int i = 0; i < old_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    old_a[k] = meeting.point(i).m_localPointA;
    old_b[k] = meeting.point(i).m_localPointB;
  }
  meeting.set_count(touches.count);
  for (int i = 0; i < touches.count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const Touch& touch = touches.at[n];
    btManifoldPoint point(X_WA.invXform(touch.p_WA), X_WB.invXform(touch.p_WB), touch.normal_W,
                          touch.distance);
    point.m_positionWorldOnA = touch.p_WA;
    point.m_positionWorldOnB = touch.p_WB;
    describe(point, pair);
    // A single point counts as the same: on a mesh's flat face it may be anywhere along a round solid.
    double least = touches.count == 1 && old_count == 1 ? std::numeric_limits<double>::infinity()
                                                        : kSamePoint * kSamePoint;
    std::size_t same = Touches::kMost;
    for (std::size_t k = 0; k < static_cast<std::size_t>(old_count); ++k) {
      const double apart =
          std::min((old_a[k] - point.m_localPointA).length2(), (old_b[k] - point.m_localPointB).length2());
      if (taken[k] || apart >= least) continue;
      least = apart;
      same = k;
    }
    meeting.sticks[n] = same < Touches::kMost ? old_sticks[same] : Stick{};
    if (same < Touches::kMost) taken[same] = true;
    point.m_userPersistentData = &meeting.sticks[n];
    meeting.point(i) = point;
  }
}

/// All contacts of two bodies; lives as long as their boxes overlap in the broadphase.
class Encounter {
 public:
  Encounter(btCollisionDispatcher& dispatcher, const btCollisionObject& a, const btCollisionObject& b)
      : of_a_(*ColliderParts::of(a)),
        of_b_(*ColliderParts::of(b)),
        dispatcher_(dispatcher),
        a_(a),
        b_(b),
        answer_(&a, &b, 0, kReach, 0) {}
  Encounter(const Encounter&) = delete;
  Encounter& operator=(const Encounter&) = delete;
  ~Encounter() {
    for (const auto& meeting : meetings_) end(*meeting);
  }

  void find(long search, const btDispatcherInfo& info) {
    const double travelled = of_a_.travelled(search) + of_b_.travelled(search);
    if (travelled < apart_until_) return;
    const auto& placed_a = of_a_.placed(search);
    const auto& placed_b = of_b_.placed(search);
    const btVector3 margin(kReach, kReach, kReach);
    const auto separation = [&](std::size_t i, std::size_t k) {
      const double reach = of_a_.box_radius(i) + margin.length() + of_b_.box_radius(k);
      const btVector3 between = placed_b[k].box_middle - placed_a[i].box_middle;
      if (between.length2() > reach * reach) return between.length() - reach;
      return box_separation(
          btTransform(placed_a[i].X_WC.getBasis(), placed_a[i].box_middle), of_a_.box_half(i) + margin,
          btTransform(placed_b[k].X_WC.getBasis(), placed_b[k].box_middle), of_b_.box_half(k));
    };
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < placed_a.size(); ++i) {
      for (std::size_t k = 0; k < placed_b.size(); ++k) {
        Meeting* known = meeting_of(i, k);
        const double apart = separation(i, k);
        least = std::min(least, apart);
        if (apart > 0) {
          if (known != nullptr) known->set_count(0);
          continue;
        }
        const ColliderPart& part_a = of_a_.parts()[i];
        const ColliderPart& part_b = of_b_.parts()[k];
        const bool closed_form =
            part_a.primitive && part_b.primitive && has_closed_form(*part_a.primitive, *part_b.primitive);
        if (known == nullptr && !closed_form) known = &begin(i, k);
        const Touches touches =
            closed_form
                ? touches_of(*part_a.primitive, placed_a[i].X_WC, *part_b.primitive, placed_b[k].X_WC, kReach)
                : ask_bullet(known->bullets, part_a, placed_a[i].X_WC, part_b, placed_b[k].X_WC, info);
        if (touches.count == 0 && known == nullptr) continue;
        if (known == nullptr) known = &begin(i, k);
        if (touches.count > MANIFOLD_CACHE_SIZE && known->manifolds[1] == nullptr)
          known->manifolds[1] = dispatcher_.getNewManifold(&a_, &b_);
        renew(*known, touches, pair_of(part_a.surface, part_b.surface));
      }
    }
    apart_until_ = travelled + least - kSlack;
  }

  void append_manifolds(btManifoldArray& manifolds) const {
    for (const auto& meeting : meetings_) {
      for (btPersistentManifold* manifold : meeting->manifolds)
        if (manifold != nullptr) manifolds.push_back(manifold);
    }
  }

 private:
  Meeting* meeting_of(std::size_t part_a, std::size_t part_b) {
    for (const auto& meeting : meetings_) {
      if (meeting->part_a == part_a && meeting->part_b == part_b) return meeting.get();
    }
    return nullptr;
  }

  Meeting& begin(std::size_t part_a, std::size_t part_b) {
    meetings_.push_back(std::make_unique<Meeting>());
    Meeting& meeting = *meetings_.back();
    meeting.part_a = part_a;
    meeting.part_b = part_b;
    meeting.manifolds[0] = dispatcher_.getNewManifold(&a_, &b_);
    return meeting;
  }

  void end(Meeting& meeting) {
    if (meeting.bullets != nullptr) {
      meeting.bullets->~btCollisionAlgorithm();
      dispatcher_.freeCollisionAlgorithm(meeting.bullets);
    }
    for (btPersistentManifold* manifold : meeting.manifolds)
      if (manifold != nullptr) dispatcher_.releaseManifold(manifold);
  }

  /// For a mesh on a box's face, everything that lies on the face. Otherwise Bullet's own result: for two
  /// meshes one face clipped by the other, or the single point of GJK.
  Touches ask_bullet(btCollisionAlgorithm*& algorithm, const ColliderPart& part_a, const btTransform& X_WCa,
                     const ColliderPart& part_b, const btTransform& X_WCb, const btDispatcherInfo& info) {
    const btCollisionObjectWrapper a(nullptr, part_a.shape, &a_, X_WCa, -1, -1);
    const btCollisionObjectWrapper b(nullptr, part_b.shape, &b_, X_WCb, -1, -1);
    if (algorithm == nullptr)
      algorithm = dispatcher_.findAlgorithm(&a, &b, &answer_, BT_CONTACT_POINT_ALGORITHMS);
    answer_.setNumContacts(0);
    btManifoldResult result(&a, &b);
    result.setPersistentManifold(&answer_);
    algorithm->processCollision(&a, &b, info, &result);
    // GJK includes a mesh's margin, the clipping of faces does not.
    const bool flat = is_flat(part_a) && is_flat(part_b);
    const double around_a = part_a.primitive || flat ? 0 : part_a.shape->getMargin();
    const double around_b = part_b.primitive || flat ? 0 : part_b.shape->getMargin();
    Touches touches;
    for (int i = 0; i < answer_.getNumContacts(); ++i) {
      const btManifoldPoint& point = answer_.getContactPoint(i);
      const btVector3& normal = point.m_normalWorldOnB;
      const double distance = point.getDistance() + around_a + around_b;
      if (distance >= kReach) continue;
      touches.at[static_cast<std::size_t>(touches.count++)] = {
          point.getPositionWorldOnA() + around_a * normal, point.getPositionWorldOnB() - around_b * normal,
          normal, distance};
    }
    if (flat && touches.count > 0 && part_a.primitive.has_value() != part_b.primitive.has_value()) {
      const btVector3 normal_W =
          std::min_element(touches.begin(), touches.end(), [](const Touch& one, const Touch& other) {
            return one.distance < other.distance;
          })->normal_W;
      const Touches all =
          part_b.primitive
              ? mesh_on_box(*hull_of(part_a), X_WCa, *part_b.primitive, X_WCb, normal_W, kReach)
              : swapped(mesh_on_box(*hull_of(part_b), X_WCb, *part_a.primitive, X_WCa, -normal_W, kReach));
      if (all.count > 0) return all;
    }
    return touches;
  }

  ColliderParts& of_a_;
  ColliderParts& of_b_;
  // Nothing can touch before the sum of both bodies' travel (`ColliderParts::travelled`) reaches this value,
  // m: a robot's arms and legs are seldom near each other, and checking all pairs anew takes a tenth of a
  // step.
  double apart_until_ = -std::numeric_limits<double>::infinity();
  btCollisionDispatcher& dispatcher_;
  const btCollisionObject& a_;
  const btCollisionObject& b_;
  btPersistentManifold answer_;  // of Bullet's algorithms
  std::vector<std::unique_ptr<Meeting>> meetings_;
};

/// Object that Bullet's broadphase keeps for a pair and deletes with it.
class EncounterAlgorithm : public btCollisionAlgorithm {
 public:
  EncounterAlgorithm(const btCollisionAlgorithmConstructionInfo& info, btCollisionDispatcher& dispatcher,
                     const btCollisionObject& a, const btCollisionObject& b)
      : btCollisionAlgorithm(info), encounter_(dispatcher, a, b) {}

  [[nodiscard]] Encounter& encounter() { return encounter_; }
  void processCollision(const btCollisionObjectWrapper* /*a*/, const btCollisionObjectWrapper* /*b*/,
                        const btDispatcherInfo& /*info*/, btManifoldResult* /*result*/) override {}
  btScalar calculateTimeOfImpact(btCollisionObject* /*a*/, btCollisionObject* /*b*/,
                                 const btDispatcherInfo& /*info*/, btManifoldResult* /*result*/) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override { encounter_.append_manifolds(manifolds); }

 private:
  Encounter encounter_;
};

}  // namespace

double box_separation(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                      const btVector3& half_b) {
  const btVector3 between = X_WB.getOrigin() - X_WA.getOrigin();
  const double reach = half_a.length() + half_b.length();
  if (between.length2() > reach * reach) return between.length() - reach;
  const btMatrix3x3 R = X_WA.getBasis().transposeTimes(X_WB.getBasis());
  const btVector3 t = between * X_WA.getBasis();  // in A
  constexpr double kParallel = 1e-9;              // nearly parallel edges give no axis of their own
  btMatrix3x3 Q = R.absolute();
  for (int i = 0; i < 3; ++i) Q[i] += btVector3(kParallel, kParallel, kParallel);
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    most = std::max({most, std::abs(t[i]) - (half_a[i] + Q[i].dot(half_b)),
                     std::abs(t.dot(R.getColumn(i))) - (half_b[i] + Q.getColumn(i).dot(half_a))});
  }
  if (most > 0) return most;
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3;
      const int k2 = (k + 2) % 3;
      const double along =
          half_a[i1] * Q[i2][k] + half_a[i2] * Q[i1][k] + half_b[k1] * Q[i][k2] + half_b[k2] * Q[i][k1];
      // The axis has a length of at most 1, so the boxes are at least this far apart.
      most = std::max(most, std::abs(t[i2] * R[i1][k] - t[i1] * R[i2][k]) - along);
    }
  }
  return most;
}

ContactDispatcher::ContactDispatcher(btCollisionConfiguration* configuration)
    : btCollisionDispatcher(configuration) {
  setNearCallback(&ContactDispatcher::meet);
}

void ContactDispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                                  btDispatcher* dispatcher) {
  ++search_;
  btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
}

void ContactDispatcher::meet(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                             const btDispatcherInfo& info) {
  if (pair.m_algorithm == nullptr) {
    const auto& a = *static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    const auto& b = *static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    if (ColliderParts::of(a) == nullptr || ColliderParts::of(b) == nullptr) return;
    if (!dispatcher.needsCollision(&a, &b)) return;
    btCollisionAlgorithmConstructionInfo construction(&dispatcher, 0);
    // Larger than the elements of the dispatcher's pool, which also frees memory that is not from the pool.
    void* memory = btAlignedAlloc(sizeof(EncounterAlgorithm), alignof(EncounterAlgorithm));
    pair.m_algorithm = new (memory) EncounterAlgorithm(construction, dispatcher, a, b);
  }
  static_cast<EncounterAlgorithm*>(pair.m_algorithm)
      ->encounter()
      .find(static_cast<ContactDispatcher&>(dispatcher).search_, info);
}

}  // namespace walkman::plant
