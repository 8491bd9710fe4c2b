#include "apps/experiment/judge.h"

#include <stdexcept>

#include <fmt/format.h>

namespace walkman::apps {
namespace {

constexpr int kRootLink = 0;           // parents come before their children
constexpr int kObject = 0;             // the experiments have one object
constexpr double kLiftedClear = 0.03;  // m above where it lay

}  // namespace

Judge::Judge(const Emulator& emulator, const Scene& scene,
             std::function<void(std::string_view)> phase_changed, std::function<void(Time)> each_cycle)
    : emulator_(emulator),
      scene_(scene),
      phase_changed_(std::move(phase_changed)),
      each_cycle_(std::move(each_cycle)) {}

void Judge::trace_to(const std::filesystem::path& csv_file) {
  trace_file_ = csv_file;
  trace_.open(csv_file);
  if (!trace_) throw std::runtime_error(csv_file.string() + ": cannot be written");
  trace_ << "# wrist force/torque sensor's reading about and in its own frame, and the hand's measured "
            "position in the "
            "stance frame\n"
            "time_s,phase,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm,hand_x_m,hand_y_m,hand_z_m\n";
}

void Judge::finish() {
  if (!trace_.is_open()) return;
  trace_.close();
  if (!trace_) throw std::runtime_error(trace_file_.string() + ": cannot be written to the end");
}

void Judge::on_phase(std::string_view phase, Time) {
  phase_ = phase;
  if (phase_changed_) phase_changed_(phase);
}

void Judge::on_cycle(Time now, const Wrench& F, const Eigen::Isometry3d& X_TH) {
  if (each_cycle_) each_cycle_(now);
  if (!trace_.is_open()) return;
  const Eigen::Vector3d p = X_TH.translation();
  trace_ << fmt::format("{:.3f},{},{:.2f},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f}\n",
                        std::chrono::duration<double>(now).count(), phase_, F.force.x(), F.force.y(),
                        F.force.z(), F.torque.x(), F.torque.y(), F.torque.z(), p.x(), p.y(), p.z());
}

void Judge::on_located(const camera::OrganizedCloud& cloud, const perception::StageOneResult&) {
  if (cloud_file_.empty()) return;
  perception::write_pcd(cloud_file_, cloud);
  cloud_file_.clear();
}

void Judge::on_stance(bool, const Eigen::Isometry3d& X_TB) {
  X_WT_ = emulator_.plant().X_WL(kRootLink) * X_TB.inverse();
}

void Judge::on_grasp(const Eigen::Isometry3d& X_TG) {
  const Eigen::Isometry3d X_OW = emulator_.plant().X_WO(kObject).inverse();
  const Eigen::Vector3d p_OG = X_OW * (X_WT_ * X_TG.translation());
  grasp_positions_.push_back(p_OG.x() + scene_.objects[kObject].length / 2);
}

void Judge::on_weighed(const regrasp::Weighing& weighing) {
  weighings_.push_back(weighing);
  always_held_ = always_held_ && held_now();
}

bool Judge::held_now() const {
  const plant::Plant& plant = emulator_.plant();
  const double risen = plant.X_WO(kObject).translation().z() - scene_.objects[kObject].X_WO.translation().z();
  return risen > kLiftedClear && !plant.object_touches_fixed(kObject);
}

}  // namespace walkman::apps
