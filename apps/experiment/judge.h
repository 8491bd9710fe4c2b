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

/// What a weighing should have reported: computed from the plant over the same cycles, by the paper's
/// definitions (sec. 3.2), with the plant's own poses.
struct TrueWeighing {
  double torque = 0;        ///< norm of the load's torque about the true grasp frame, N·m, signed like d
  double displacement = 0;  ///< d from the true grasp frame to the object's true centre of mass, m
  double com_error = 0;     ///< reported minus true centre of mass along the handle, m: includes the error of
                            ///< the assumed hand position
  Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< the object's true centre of mass from the true Ho, m
  double torque_about_handle = 0;                   ///< the part of the torque about the handle's axis, N·m
  double slip = 0;  ///< path of the object in the hand since the first lift, while held by nothing else, m
  double slip_turn = 0;  ///< angle turned along that path, in any direction, rad
  double d_r = 0;        ///< centre of mass along the object's x axis from its left end, m
  double d_v = 0;        ///< the same for the hand when it had closed
};

/// Returns why a report is wrong, one sentence; nullopt if it is right: the centre of mass within
/// `displacement_threshold` (m) of the reported one, the torque, and its part about the handle, within 0.1
/// N·m, 10 % of the reported torque, or three of the standard deviations reported with it, whichever is
/// largest.
[[nodiscard]] std::optional<std::string> contradiction(const regrasp::Weighing& reported,
                                                       const TrueWeighing& truth,
                                                       double displacement_threshold);

/// Centroid of the volume occupied by all of an object's collision shapes together, in the object's frame, m,
/// on a grid of 4 mm. It is not the centre of mass, which depends on the object's materials.
[[nodiscard]] Eigen::Vector3d volume_centroid(const RobotModel& object);

/// Observes a run from both sides of the buses: records what the pipeline assumes, and what the plant knows.
///
/// The position of a grasp on the object, the object's weight and whether it is held are ground truth; none
/// of it is fed back.
class Judge : public regrasp::Observer {
 public:
  /// `phase_changed` is called with every phase as it begins, `each_cycle` with every cycle's time, `warned`
  /// with every warning of the drivers and the method.
  Judge(const Emulator& emulator, const Scene& scene, const KnownRobot& robot,
        std::function<void(std::string_view)> phase_changed, std::function<void(Time)> each_cycle,
        std::function<void(std::string_view)> warned = {});

  /// Starts writing the wrench trace, as CSV; `note`: one line for its head, omitted if empty. Throws
  /// EnvironmentError.
  void trace_to(const std::filesystem::path& csv_file, std::string_view note);
  /// Writes the first cloud as PCD, and what was detected in it as a picture.
  void keep_cloud(std::filesystem::path pcd_file, std::filesystem::path picture) {
    cloud_file_ = std::move(pcd_file);
    picture_file_ = std::move(picture);
  }

  /// Records contacts that the robot should not have now. To be called every cycle.
  void watch_contacts() { touch_watch_.look(emulator_.plant(), phase_); }

  /// Writes the trace out to its file. Throws EnvironmentError if any part of it, or the cloud, could not be
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

  /// Position of each grasp on the object, m from its left end: of the hand when it had closed; of the chosen
  /// grasp frame, when it was chosen, if the hand did not get that far.
  [[nodiscard]] const std::vector<double>& grasp_positions() const { return grasp_positions_; }
  [[nodiscard]] const std::vector<regrasp::Weighing>& weighings() const { return weighings_; }
  /// One for each of `weighings`.
  [[nodiscard]] const std::vector<TrueWeighing>& true_weighings() const { return true_weighings_; }
  /// The faults from which the drivers recovered, one sentence each.
  [[nodiscard]] const std::vector<std::string>& recovered_from() const { return recovered_from_; }
  /// Distance from the centroid of the object's volume to the visual centre of mass used to choose the first
  /// grasp, m: both from the true camera. 0 until then.
  [[nodiscard]] double visual_com_error() const { return visual_com_error_; }
  /// Warnings of the drivers and the method, one sentence each.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  /// Whether the object hung free of everything but the hand at each weighing.
  [[nodiscard]] bool always_held() const { return always_held_; }
  /// Index of the scene's object that the robot works on: the one whose surface the first grasp is on; the
  /// first object until then.
  [[nodiscard]] int object() const { return object_; }
  /// Contacts that the robot should not have had.
  [[nodiscard]] const std::vector<UnwantedTouch>& touches() const { return touch_watch_.touches(); }
  /// Whether the object hangs free now.
  [[nodiscard]] bool held_now() const;

 private:
  void watch(const HandParts& hand);
  [[nodiscard]] Wrench object_load() const;
  [[nodiscard]] TrueWeighing judged(const regrasp::Weighing& reported) const;
  [[nodiscard]] const SceneObject& object_in_scene() const {
    return scene_.objects[static_cast<std::size_t>(object_)];
  }
  /// Returns where a point (m in W) is along the object, m from its left end.
  [[nodiscard]] double place_on_object(const Eigen::Vector3d& p_W) const;
  /// Index of the object whose surface is nearest to a point, m in W.
  [[nodiscard]] int object_at(const Eigen::Vector3d& p_W) const;

  const Emulator& emulator_;
  const Scene& scene_;
  const RobotModel& robot_;  // as it truly is
  const RobotModel& model_;  // as the drivers know it
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
  Eigen::Isometry3d X_WT_ = Eigen::Isometry3d::Identity();  // pose of the stance frame in the plant's world
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
  std::optional<Eigen::Vector3d> p_WCm_seen_;                     // from the first look
  double visual_com_error_ = 0;
};

}  // namespace walkman::apps
