#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adaptation/motion/body_shape.h"
#include "adaptation/motion/hand_motion.h"
#include "adaptation/parameters.h"
#include "adaptation/perception/stage_one.h"
#include "urdf/reader/robot_description.h"

namespace walkman::regrasp {

/// From the grasp frame G to the poses of the hand on the way to it: over it and behind, over it, and on it
/// with the palm `clearance` (m) off the surface. Over is along G's y axis, against the palm.
[[nodiscard]] std::vector<Eigen::Isometry3d> approach_way(const Eigen::Isometry3d& X_TG, double clearance,
                                                          const StageTwoParameters& parameters);

/// Which hand grasps where, and how it is turned about the handle.
struct PlannedGrasp {
  std::size_t hand = 0;  ///< its place in the robot's description
  Eigen::Isometry3d X_TG = Eigen::Isometry3d::Identity();
  double pitch = 0;       ///< from upright, about the handle, rad
  double radius = 0;      ///< of the handle there, m
  double cost = 0;        ///< of the place, see GraspPlanner::Cost
  double least_cost = 0;  ///< of the best place, which it may not be
  std::string refusal;    ///< what keeps the hands off the best place, empty when it is that
  /// Least cost of the places where a hand has room and no way to get there from where it is; infinite
  /// without.
  double unreached_cost = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Isometry3d> way;  ///< from where the hand is to the pose over the grasp
  Eigen::Isometry3d X_TH = Eigen::Isometry3d::Identity();  ///< of the hand when it closes
  std::vector<motion::NamedObstacle> obstacles;            ///< on that way, in T
};

/// Finds grasps that a hand can reach with room for itself.
///
/// A grasp stands for all that the method does with it: the way there, the lift to `lift_max` and the turns
/// to weigh. The open hand on its last stretch and the closing fingers keep off the table and off every point
/// of the cloud but those of the handle.
class GraspPlanner {
 public:
  /// A grasp that a hand was to take when its way turned out to be blocked.
  struct Blocked {
    std::size_t hand = 0;
    Eigen::Vector3d p_TG = Eigen::Vector3d::Zero();
    std::string reason;
  };
  /// What the grasps are planned for.
  struct View {
    const perception::StageOneResult* seen = nullptr;
    Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();
    std::vector<motion::NamedObstacle> obstacles;  ///< in T
    /// The reference to start from, and where the robot stood up; rad, joint_names order.
    Eigen::VectorXd q, q_stood;
    /// Nearer to one of these than what counts, the displacement threshold, there is no grasp for that hand.
    std::vector<Blocked> blocked = {};
  };
  /// How far a place on a handle (m from its middle) is from the wanted one, m.
  using Cost = std::function<double(const perception::Handle& handle, double along)>;

  /// References are kept. Without a stance the base is held.
  GraspPlanner(const KnownRobot& known, const std::vector<std::string>& joint_names,
               const std::optional<motion::Stance>& stance, const MethodParameters& parameters);

  /// At the nearest place that either hand can grasp, the grasp with the most room: to joints' limits, to the
  /// robot's own links, to what is on the table. A place with less room beside the handle is taken when the
  /// next roomier one is farther off by more than the displacement threshold. Places are tried at steps that
  /// grow with the distance; the last step is halved down to 2 mm with the same hand, turned the same. Takes
  /// seconds.
  /// Throws RunStopped with what stops each hand at the nearest place when there is none that costs less than
  /// `nearer_than` (m).
  [[nodiscard]] PlannedGrasp plan(const View& view, const Cost& cost,
                                  double nearer_than = std::numeric_limits<double>::infinity());

 private:
  struct Hand {
    motion::HandMotion motion;
    std::vector<std::vector<motion::BodyShape>> closing;  // shapes in H, from open to closed
    std::vector<Eigen::Isometry3d> led = {};              // via points of its last way
  };
  struct Place {
    int handle;
    double along, cost;
  };
  /// Along the handles, the cheapest first, farther from each other with their distance from the best.
  [[nodiscard]] std::vector<Place> places(const View& view, const Cost& cost) const;
  /// Where the grasp would be; whether it can be and its way are `judge`'s.
  [[nodiscard]] static PlannedGrasp planned_at(const View& view, const Place& place, std::size_t hand,
                                               double pitch);
  /// Why a grasp cannot be: what would touch, or that there is or was no way to it. No reason when it can.
  struct Refusal {
    std::string reason;
    bool beside = false;  // touches what lies beside the handle
    bool no_way = false;
  };
  [[nodiscard]] Refusal touching(const View& view, const Hand& hand, const Place& place, double beside_room,
                                 const Eigen::Isometry3d& X_TEnd) const;
  /// "the right hand: ...; the left hand: ...".
  [[nodiscard]] std::string both_hands(const std::vector<std::string>& refusals) const;
  /// Room of the grasp, as a share of what is enough; kNoGrasp when it cannot be.
  [[nodiscard]] double judge(const View& view, Hand& hand, const Place& place, double beside_room,
                             PlannedGrasp& grasp, Refusal& refusal);
  struct Refusals {
    std::vector<std::string> first;  // of each hand
    bool beside = false;             // any for want of room beside the handle
    double unreached_cost = std::numeric_limits<double>::infinity();
  };
  /// The grasp with the most room there, none when no hand can; `beside_room` is what the hand keeps to what
  /// is beside the handle, m.
  [[nodiscard]] std::optional<PlannedGrasp> grasp_at(const View& view, const Place& place,
                                                     std::size_t pitches, double beside_room,
                                                     Refusals& refusals);
  /// `grasp`, found at `place` of `all`, as near to the wanted place as the hand can be turned like that: by
  /// halves of what is between `place` and the next cheaper one of its handle, which was refused.
  [[nodiscard]] PlannedGrasp nearest(const View& view, const Cost& cost, const std::vector<Place>& all,
                                     const Place& place, double beside_room, PlannedGrasp grasp);

  const KnownRobot& known_;
  const MethodParameters& parameters_;
  std::vector<std::unique_ptr<Hand>> hands_;
};

}  // namespace walkman::regrasp
