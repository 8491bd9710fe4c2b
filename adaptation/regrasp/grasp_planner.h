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

/// Returns the hand poses of the approach to the grasp frame G: above and behind it, above it, and at it with
/// the palm `clearance` (m) off the surface. Above means along G's y axis, against the palm.
[[nodiscard]] std::vector<Eigen::Isometry3d> approach_way(const Eigen::Isometry3d& X_TG, double clearance,
                                                          const StageTwoParameters& parameters);

/// A planned grasp: which hand, where, and its rotation about the handle.
struct PlannedGrasp {
  std::size_t hand = 0;  ///< index in the robot's description
  Eigen::Isometry3d X_TG = Eigen::Isometry3d::Identity();
  double pitch = 0;       ///< from upright, about the handle, rad
  double radius = 0;      ///< of the handle there, m
  double cost = 0;        ///< of the place, see GraspPlanner::Cost
  double least_cost = 0;  ///< of the best place, which this one need not be
  std::string refusal;    ///< what keeps the hands from the best place; empty if this is it
  /// Least cost among the places where a hand has room but no way to get there from its present pose;
  /// infinite if there are none.
  double unreached_cost = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Isometry3d> way;  ///< from the hand's present pose to the pose above the grasp
  Eigen::Isometry3d X_TH = Eigen::Isometry3d::Identity();  ///< of the hand when it closes
  std::vector<motion::NamedObstacle> obstacles;            ///< on that way, in T
};

/// Finds grasps that a hand can reach and has room for.
///
/// A grasp covers everything that the method does with it: the way there, the lift to `lift_max` and the
/// turns for weighing. The open hand on its last stretch stays clear of the table, and it and the closing
/// fingers stay clear of every point of the cloud except those of the handle; closing fingers may slide along
/// the table.
class GraspPlanner {
 public:
  /// A grasp whose way turned out to be blocked, and the hand that was to take it.
  struct Blocked {
    std::size_t hand = 0;
    Eigen::Vector3d p_TG = Eigen::Vector3d::Zero();
    std::string reason;
  };
  /// Input of the planning.
  struct View {
    const perception::StageOneResult* seen = nullptr;
    Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();
    std::vector<motion::NamedObstacle> obstacles;  ///< in T
    /// The reference to start from, and the positions in which the robot stood up; rad, joint_names order.
    Eigen::VectorXd q, q_stood;
    /// A hand is not given a grasp closer to one of its blocked ones than the displacement threshold.
    std::vector<Blocked> blocked = {};
  };
  /// Distance of a place on a handle (m from its middle) from the desired one, m.
  using Cost = std::function<double(const perception::Handle& handle, double along)>;

  /// Keeps references. Without a stance the base is held.
  GraspPlanner(const KnownRobot& known, const std::vector<std::string>& joint_names,
               const std::optional<motion::Stance>& stance, const MethodParameters& parameters);

  /// Returns the grasp with the most room at the nearest place that either hand can grasp: room to joint
  /// limits, to the robot's own links and to objects on the table. Takes a place with less room beside the
  /// handle if the next roomier one is farther away by more than the displacement threshold. Tries places at
  /// steps that grow with the distance; the last step is bisected down to 2 mm with the same hand and
  /// rotation. Takes seconds. Throws RunStopped, stating what stops each hand at the nearest place, if no
  /// grasp costs less than `nearer_than` (m).
  [[nodiscard]] PlannedGrasp plan(const View& view, const Cost& cost,
                                  double nearer_than = std::numeric_limits<double>::infinity());

 private:
  struct Hand {
    motion::HandMotion motion;
    std::vector<std::vector<motion::BodyShape>> closing;  // shapes in H, from open to closed
    std::vector<Eigen::Isometry3d> led = {};              // via points of its last route
  };
  struct Place {
    int handle;
    double along, cost;
  };
  /// Places along the handles, cheapest first, spaced more widely the farther they are from the best one.
  [[nodiscard]] std::vector<Place> places(const View& view, const Cost& cost) const;
  /// Returns the grasp's pose; `judge` decides whether it is possible and finds its way.
  [[nodiscard]] static PlannedGrasp planned_at(const View& view, const Place& place, std::size_t hand,
                                               double pitch);
  /// Why a grasp is not possible: what would touch, or that there is or was no way to it. Without a reason it
  /// is possible.
  struct Refusal {
    std::string reason;
    bool beside = false;  // touches something beside the handle
    bool no_way = false;
  };
  [[nodiscard]] Refusal touching(const View& view, const Hand& hand, const Place& place, double beside_room,
                                 const Eigen::Isometry3d& X_TEnd) const;
  /// Returns what of the hand would touch the object on its way `way`, before it is above the grasp.
  [[nodiscard]] Refusal crossing(const View& view, const Hand& hand,
                                 const std::vector<Eigen::Isometry3d>& way) const;
  /// "the right hand: ...; the left hand: ...".
  [[nodiscard]] std::string both_hands(const std::vector<std::string>& refusals) const;
  /// Returns the room of the grasp as a share of what is enough; kNoGrasp if it is not possible.
  [[nodiscard]] double judge(const View& view, Hand& hand, const Place& place, double beside_room,
                             PlannedGrasp& grasp, Refusal& refusal);
  struct Refusals {
    std::vector<std::string> first;  // first refusal of each hand
    bool beside = false;             // whether any is for lack of room beside the handle
    double unreached_cost = std::numeric_limits<double>::infinity();
  };
  /// Returns the grasp with the most room at `place`; nullopt if no hand can grasp there. `beside_room`:
  /// clearance of the hand from anything beside the handle, m.
  [[nodiscard]] std::optional<PlannedGrasp> grasp_at(const View& view, const Place& place,
                                                     std::size_t pitches, double beside_room,
                                                     Refusals& refusals);
  /// Returns `grasp`, found at `place` of `all`, moved as close to the desired place as the hand can go with
  /// the same rotation, by bisection between `place` and the next cheaper place on its handle, which was
  /// refused.
  [[nodiscard]] PlannedGrasp nearest(const View& view, const Cost& cost, const std::vector<Place>& all,
                                     const Place& place, double beside_room, PlannedGrasp grasp);

  const KnownRobot& known_;
  const MethodParameters& parameters_;
  std::vector<std::unique_ptr<Hand>> hands_;
};

}  // namespace walkman::regrasp
