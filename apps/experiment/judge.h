#pragma once

#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adaptation/regrasp/observer.h"
#include "adaptation/wrench/carried_load.h"
#include "apps/experiment/touches.h"
#include "emulator/emulator.h"
#include "emulator/scene/scene.h"

namespace walkman::apps {

/// What one weighing should have reported: by the plant, over the same cycles, with the paper's definitions
/// (sec. 3.2) in the plant's own poses.
struct TrueWeighing {
  double torque = 0;        ///< norm of the load's torque about the true grasp frame, N·m, signed like d
  double displacement = 0;  ///< d from the true grasp frame to the object's true centre of mass, m
  double com_error = 0;     ///< reported less true centre of mass along the handle, m: where the hand was
                            ///< thought to be is in it
  Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< the object's true centre of mass from the true Ho, m
  double torque_about_handle = 0;                   ///< the part of the torque about the handle's axis, N·m
  double slip = 0;  ///< path of the object in the hand since the first lift, while nothing else held it, m
  double slip_turn = 0;  ///< and the angle it has turned there by, whichever way, rad
  double d_r = 0;        ///< centre of mass along the object's x axis from its left end, m
  double d_v = 0;        ///< the same of the grasp frame when it was chosen
};

/// Why what was reported is not so, one sentence; none when it is: the centre of mass within
/// `displacement_threshold` (m) of where it was reported, the torque within 0.1 N·m, 10 % of the reported, or
/// three of the standard deviations reported with it, whichever is most.
[[nodiscard]] std::optional<std::string> contradiction(const regrasp::Weighing& reported,
                                                       const TrueWeighing& truth,
                                                       double displacement_threshold);

/// Centroid of the volume that an object's collision shapes take up together, in its own frame, m: on a grid
/// of 4 mm. Not its centre of mass: that depends on what it is made of.
[[nodiscard]] Eigen::Vector3d volume_centroid(const RobotModel& object);

/// Watches a run from both sides of the wire: notes what the pipeline believes, and what the plant knows.
///
/// Where a grasp lies on the object, what it weighs and whether it is held is ground truth; nothing of it
/// goes back.
class Judge : public regrasp::Observer {
 public:
  /// `phase_changed` is told every phase as it begins, `each_cycle` every cycle's time, `warned` every
  /// warning of the drivers and the method.
  Judge(const Emulator& emulator, const Scene& scene, const KnownRobot& robot,
        std::function<void(std::string_view)> phase_changed, std::function<void(Time)> each_cycle,
        std::function<void(std::string_view)> warned = {});

  /// Writes the wrench trace from now on, as CSV. Throws EnvironmentError.
  void trace_to(const std::filesystem::path& csv_file);
  /// Writes the first cloud as PCD, and what was seen in it as a picture.
  void keep_cloud(std::filesystem::path pcd_file, std::filesystem::path picture) {
    cloud_file_ = std::move(pcd_file);
    picture_file_ = std::move(picture);
  }

  /// Brings the trace to its file. Throws EnvironmentError when any of it, or the cloud, could not be
  /// written.
  void finish();

  void on_phase(std::string_view phase, Time now) override;
  void on_recovery(std::string_view reason, Time /*now*/) override { recovered_from_.emplace_back(reason); }
  void on_warning(std::string_view warning, Time now) override;
  void on_hand(const HandParts& hand) override;
  void on_stance(bool stands, const Eigen::Isometry3d& X_TB) override;
  void on_cycle(Time now, const Wrench& F_So_S, const Eigen::Isometry3d& X_TH) override;
  void on_located(const camera::OrganizedCloud& cloud, const perception::StageOneResult& result) override;
  void on_grasp(const Eigen::Isometry3d& X_TG) override;
  void on_weighed(const regrasp::Weighing& weighing) override;

  /// Where each chosen grasp frame lay on the object, m from its left end, when it was chosen.
  [[nodiscard]] const std::vector<double>& grasp_positions() const { return grasp_positions_; }
  [[nodiscard]] const std::vector<regrasp::Weighing>& weighings() const { return weighings_; }
  /// One for each of `weighings`.
  [[nodiscard]] const std::vector<TrueWeighing>& true_weighings() const { return true_weighings_; }
  /// The faults that the drivers got over, one sentence each.
  [[nodiscard]] const std::vector<std::string>& recovered_from() const { return recovered_from_; }
  /// Of the visual centre of mass that the first grasp was chosen by, from the centroid of the object's
  /// volume, m: both from the true camera. 0 until then.
  [[nodiscard]] double visual_com_error() const { return visual_com_error_; }
  /// Of the drivers and the method, one sentence each.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  /// At each weighing the object hung free of everything but the hand.
  [[nodiscard]] bool always_held() const { return always_held_; }
  /// Which of the scene's objects the robot works on: the one whose surface the first grasp is on; the first
  /// until then.
  [[nodiscard]] int object() const { return object_; }
  /// What the robot has touched that it should not have.
  [[nodiscard]] const std::vector<UnwantedTouch>& touches() const { return touch_watch_.touches(); }
  /// The object hangs free now.
  [[nodiscard]] bool held_now() const;

 private:
  void watch(const HandParts& hand);
  [[nodiscard]] Wrench object_load() const;
  [[nodiscard]] TrueWeighing judged(const regrasp::Weighing& reported) const;
  [[nodiscard]] const SceneObject& object_in_scene() const {
    return scene_.objects[static_cast<std::size_t>(object_)];
  }
  /// The object whose surface is nearest to a point, m in W.
  [[nodiscard]] int object_at(const Eigen::Vector3d& p_W) const;

  const Emulator& emulator_;
  const Scene& scene_;
  const RobotModel& robot_;  // as it truly is
  const RobotModel& model_;  // as the driver side knows it
  const DeviceTable& devices_;
  int object_ = 0;
  int sensor_ = -1, hand_ = -1, sensor_link_ = -1, grasp_link_ = -1;
  std::vector<std::size_t> hand_links_;  // below the sensor
  std::function<void(std::string_view)> phase_changed_;
  std::function<void(Time)> each_cycle_;
  std::function<void(std::string_view)> warned_;
  std::vector<std::string> warnings_;
  std::filesystem::path cloud_file_, picture_file_;
  std::string cloud_error_;
  std::filesystem::path trace_file_;
  std::ofstream trace_;
  std::string phase_;
  Eigen::Isometry3d X_WT_ = Eigen::Isometry3d::Identity();  // where the stance is in the plant's world
  std::vector<double> grasp_positions_;
  std::vector<regrasp::Weighing> weighings_;
  std::vector<TrueWeighing> true_weighings_;
  wrench::WrenchAverage load_;  // about the true Ho in W
  wrench::WrenchAverage tare_;  // reading of the last tare
  Eigen::Vector3d p_SoHo_S_ = Eigen::Vector3d::Zero();
  Wrench newest_load_;
  bool always_held_ = true;
  TouchWatch touch_watch_;
  std::vector<std::string> recovered_from_;
  std::deque<std::pair<std::uint64_t, Eigen::Isometry3d>> X_WC_;  // of the last exposures
  std::optional<Eigen::Vector3d> p_WCm_seen_;                     // of the first look
  double visual_com_error_ = 0;
};

}  // namespace walkman::apps
