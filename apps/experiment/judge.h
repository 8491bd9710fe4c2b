#pragma once

#include <fstream>
#include <functional>
#include <vector>

#include "adaptation/regrasp/observer.h"
#include "emulator/emulator.h"
#include "emulator/scene/scene.h"

namespace walkman::apps {

/// Watches a run from both sides of the wire: notes what the pipeline believes, and what the plant knows.
///
/// Where a grasp lies on the object and whether the object is held is ground truth; nothing of it goes back.
class Judge : public regrasp::Observer {
 public:
  /// `phase_changed` is told every phase as it begins, `each_cycle` every cycle's time.
  Judge(const Emulator& emulator, const Scene& scene, std::function<void(std::string_view)> phase_changed,
        std::function<void(Time)> each_cycle);

  /// Writes the wrench trace from now on, as CSV.
  void trace_to(const std::filesystem::path& csv_file);
  /// Writes the first cloud as PCD.
  void keep_cloud(std::filesystem::path pcd_file) { cloud_file_ = std::move(pcd_file); }

  /// Brings the trace to its file. Throws std::runtime_error when any of it could not be written.
  void finish();

  void on_phase(std::string_view phase, Time now) override;
  void on_stance(bool stands, const Eigen::Isometry3d& X_TB) override;
  void on_cycle(Time now, const Wrench& F_So_S, const Eigen::Isometry3d& X_TH) override;
  void on_located(const camera::OrganizedCloud& cloud, const perception::StageOneResult& result) override;
  void on_grasp(const Eigen::Isometry3d& X_TG) override;
  void on_weighed(const regrasp::Weighing& weighing) override;

  /// Where each chosen grasp frame lay on the object, m from its left end, when it was chosen.
  [[nodiscard]] const std::vector<double>& grasp_positions() const { return grasp_positions_; }
  [[nodiscard]] const std::vector<regrasp::Weighing>& weighings() const { return weighings_; }
  /// At each weighing the object hung free of everything but the hand.
  [[nodiscard]] bool always_held() const { return always_held_; }
  /// The object hangs free now.
  [[nodiscard]] bool held_now() const;

 private:
  const Emulator& emulator_;
  const Scene& scene_;
  std::function<void(std::string_view)> phase_changed_;
  std::function<void(Time)> each_cycle_;
  std::filesystem::path cloud_file_;
  std::filesystem::path trace_file_;
  std::ofstream trace_;
  std::string phase_;
  Eigen::Isometry3d X_WT_ = Eigen::Isometry3d::Identity();  // where the stance is in the plant's world
  std::vector<double> grasp_positions_;
  std::vector<regrasp::Weighing> weighings_;
  bool always_held_ = true;
};

}  // namespace walkman::apps
