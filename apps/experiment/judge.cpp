#include "apps/experiment/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "adaptation/motion/body_shape.h"
#include "adaptation/perception/pcd.h"
#include "adaptation/regrasp/session.h"
#include "adaptation/wrench/carried_load.h"
#include "apps/picture/png_file.h"
#include "apps/picture/seen_picture.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/result_files.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr int kRootLink = 0;              // parents come before their children
constexpr std::size_t kExposures = 1000;  // about a minute of them, longer than a survey
constexpr double kLiftedClear = 0.03;     // m above its initial position

constexpr double kTorqueTolerance = 0.1;  // N·m
constexpr double kTorqueShare = 0.1;      // of the reported torque
constexpr double kDeviations = 3;         // reported with the torque

/// Index of a named device among the device table's devices of the same kind.
int place_of(const std::string& name, DeviceKind kind, const DeviceTable& devices) {
  int place = 0;
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind != kind) continue;
      if (device.name == name) return place;
      ++place;
    }
  }
  throw std::runtime_error(
      fmt::format("the device table has no {} '{}'",
                  kind == DeviceKind::kForceTorque ? "force/torque sensor" : "hand drive", name));
}

}  // namespace

std::optional<std::string> contradiction(const regrasp::Weighing& reported, const TrueWeighing& truth,
                                         double displacement_threshold) {
  if (!(std::abs(truth.com_error) <= displacement_threshold)) {
    return fmt::format(
        "the true centre of mass is {:.1f} mm to the {} of where it was reported, expected at most {:.1f} mm",
        1e3 * std::abs(truth.com_error), truth.com_error < 0 ? "right" : "left",
        1e3 * displacement_threshold);
  }
  const double found = std::abs(truth.torque), said = std::abs(reported.torque);
  const double tolerance =
      std::max({kTorqueTolerance, kTorqueShare * said, kDeviations * reported.torque_deviation});
  if (!(std::abs(found - said) <= tolerance)) {
    return fmt::format(
        "the true torque is {:.3f} N·m and {:.3f} N·m was reported, expected at most {:.3f} N·m between them",
        found, said, tolerance);
  }
  // Torques of the same size may point in opposite directions.
  const double about = truth.torque_about_handle, said_about = reported.torque_about_handle;
  if (!(std::abs(about - said_about) <= tolerance)) {
    return fmt::format(
        "the true torque about the handle's axis is {:.3f} N·m and {:.3f} N·m was reported, expected at most "
        "{:.3f} N·m between them",
        about, said_about, tolerance);
  }
  return std::nullopt;
}

Judge::Judge(const Emulator& emulator, const Scene& scene, const KnownRobot& robot,
             std::function<void(std::string_view)> phase_changed, std::function<void(Time)> each_cycle,
             std::function<void(std::string_view)> warned)
    : emulator_(emulator),
      scene_(scene),
      robot_(emulator.robot()),
      model_(robot.model),
      devices_(robot.devices),
      phase_changed_(std::move(phase_changed)),
      each_cycle_(std::move(each_cycle)),
      warned_(std::move(warned)),
      touch_watch_(robot, scene.objects.front().name) {
  watch(robot.description.working_hands().front());
}

void Judge::on_hand(const HandParts& hand) { watch(hand); }

void Judge::watch(const HandParts& hand) {
  sensor_ = place_of(hand.force_torque, DeviceKind::kForceTorque, devices_);
  hand_ = place_of(hand.motor, DeviceKind::kHandDrive, devices_);
  sensor_link_ = robot_.link_index(hand.force_torque);
  grasp_link_ = robot_.link_index(hand.frame);
  const std::vector<Eigen::Isometry3d> X_RL = link_poses(model_, {});
  p_SoHo_S_ = (X_RL[static_cast<std::size_t>(model_.link_index(hand.force_torque))].inverse() *
               X_RL[static_cast<std::size_t>(model_.link_index(hand.frame))])
                  .translation();
  hand_links_ = links_below(robot_, static_cast<std::size_t>(sensor_link_));
}

void Judge::trace_to(const std::filesystem::path& csv_file, std::string_view note) {
  trace_file_ = csv_file;
  trace_.open(partial(csv_file));
  if (!trace_) throw EnvironmentError(csv_file.string() + ": cannot be written");
  if (!note.empty()) trace_ << "# " << note << '\n';
  trace_
      << "# wrist force/torque sensor's reading about and in its own frame, the hand's measured position in "
         "the "
         "stance frame, and the norm of the torque about the hand frame relative to the last tare\n"
         "time_s,phase,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm,hand_x_m,hand_y_m,hand_z_m,torque_Nm\n";
}

void Judge::finish() {
  if (trace_.is_open()) {
    trace_.close();
    if (!trace_) throw EnvironmentError(trace_file_.string() + ": cannot be written to the end");
    publish(trace_file_);
  }
  if (!cloud_error_.empty()) throw EnvironmentError(cloud_error_);
}

void Judge::on_phase(std::string_view phase, Time) {
  phase_ = phase;
  if (phase == "tare") tare_ = {};
  if (phase == "lift")
    grasp_positions_.back() = place_on_object(emulator_.plant().X_WL(grasp_link_).translation());
  if (phase == "weigh") {
    load_ = {};
    newest_load_ = object_load();
  }
  if (phase_changed_) phase_changed_(phase);
}

void Judge::on_cycle(Time now, const Wrench& F, const Eigen::Isometry3d& X_TH) {
  if (phase_ == "weigh") {
    // A weighing takes a cycle's reading before it waits for the next, so it does not include the last one.
    load_.add(newest_load_);
    newest_load_ = object_load();
  }
  const Exposure& exposure = emulator_.camera().exposure();
  if (X_WC_.empty() || X_WC_.back().first != exposure.frame) {
    X_WC_.emplace_back(exposure.frame, exposure.X_WC);
    if (X_WC_.size() > kExposures) X_WC_.pop_front();
  }
  if (each_cycle_) each_cycle_(now);
  if (!trace_.is_open()) return;
  if (phase_ == "tare") tare_.add(F);
  const Wrench more{F.torque - tare_.mean().torque, F.force - tare_.mean().force};
  const double torque = tare_.count() == 0 ? 0 : wrench::shift(more, p_SoHo_S_).torque.norm();
  const Eigen::Vector3d p = X_TH.translation();
  trace_ << fmt::format("{:.3f},{},{:.2f},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f},{:.3f}\n",
                        std::chrono::duration<double>(now).count(), phase_, F.force.x(), F.force.y(),
                        F.force.z(), F.torque.x(), F.torque.y(), F.torque.z(), p.x(), p.y(), p.z(), torque);
}

void Judge::on_located(const camera::OrganizedCloud& cloud, const perception::StageOneResult& seen) {
  const auto exposed = std::find_if(X_WC_.begin(), X_WC_.end(),
                                    [&](const auto& exposure) { return exposure.first == cloud.frame; });
  if (!p_WCm_seen_ && exposed != X_WC_.end()) p_WCm_seen_ = exposed->second * seen.object().p_CCm;
  if (cloud_file_.empty()) return;
  try {
    perception::write_pcd(partial(cloud_file_), cloud);
    publish(cloud_file_);
    write_png(seen_picture(cloud, seen), partial(picture_file_));
    publish(picture_file_);
  } catch (const std::runtime_error& e) {
    cloud_error_ = e.what();  // the run continues without them
  }
  cloud_file_.clear();
}

void Judge::on_warning(std::string_view warning, Time) {
  warnings_.emplace_back(warning);
  if (warned_) warned_(warning);
}

void Judge::on_stance(bool, const Eigen::Isometry3d& X_TB) {
  X_WT_ = emulator_.plant().X_WL(kRootLink) * X_TB.inverse();
}

void Judge::on_grasp(const Eigen::Isometry3d& X_TG) {
  const Eigen::Vector3d p_WG = X_WT_ * X_TG.translation();
  if (grasp_positions_.empty()) {
    object_ = object_at(p_WG);
    touch_watch_.grasps(object_in_scene().name);
    if (p_WCm_seen_) {
      const Eigen::Vector3d p_OCv = volume_centroid(plant::with_weights(object_in_scene()));
      visual_com_error_ = (*p_WCm_seen_ - emulator_.plant().X_WO(object_) * p_OCv).norm();
    }
  }
  grasp_positions_.push_back(place_on_object(p_WG));
}

double Judge::place_on_object(const Eigen::Vector3d& p_W) const {
  return (emulator_.plant().X_WO(object_).inverse() * p_W).x() - object_in_scene().left_end;
}

void Judge::on_weighed(const regrasp::Weighing& weighing) {
  weighings_.push_back(weighing);
  true_weighings_.push_back(judged(weighing));
  always_held_ = always_held_ && held_now();
}

int Judge::object_at(const Eigen::Vector3d& p_W) const {
  int nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const RobotModel& model = scene_.objects[i].model;
    const std::vector<Eigen::Isometry3d> X_OL = link_poses(model, {});
    const Eigen::Vector3d p_O = emulator_.plant().X_WO(static_cast<int>(i)).inverse() * p_W;
    for (const motion::BodyShape& shape : motion::body_shapes(model)) {
      const Eigen::Vector3d p_S = (X_OL[static_cast<std::size_t>(shape.link)] * shape.X_LS).inverse() * p_O;
      const double distance = (p_S - shape.nearest_S(p_S)).norm() - shape.rounding;
      if (distance >= least) continue;
      least = distance;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

/// The true load on the wrist other than the hand: about the true Ho, in W.
Wrench Judge::object_load() const {
  const plant::Plant& plant = emulator_.plant();
  const Eigen::Isometry3d X_WS = plant.X_WL(sensor_link_);
  const Wrench& F_So_S = plant.F_So_S(sensor_);
  Wrench F_So_W{X_WS.linear() * F_So_S.torque, X_WS.linear() * F_So_S.force};
  for (const std::size_t i : hand_links_) {
    const Link& link = robot_.links[i];
    const Eigen::Vector3d weight(0, 0, -link.mass * plant.gravity());
    const Eigen::Vector3d p_WLcm = plant.X_WL(static_cast<int>(i)) * link.p_LLcm;
    F_So_W.force -= weight;
    F_So_W.torque -= (p_WLcm - X_WS.translation()).cross(weight);
  }
  return wrench::shift(F_So_W, plant.X_WL(grasp_link_).translation() - X_WS.translation());
}

TrueWeighing Judge::judged(const regrasp::Weighing& reported) const {
  const plant::Plant& plant = emulator_.plant();
  const Eigen::Isometry3d X_WH = plant.X_WL(grasp_link_);
  const Eigen::Vector3d p_WCm = plant.X_WO(object_) * plant.object(object_).p_OOcm();
  const Eigen::Vector3d right_W = X_WH.linear().col(0);
  const Eigen::Vector3d level_W(right_W.x(), right_W.y(), 0);
  TrueWeighing out;
  out.d_r = plant.object(object_).p_OOcm().x() - object_in_scene().left_end;
  out.d_v = grasp_positions_.empty() ? 0 : grasp_positions_.back();
  out.displacement = level_W.dot(p_WCm - X_WH.translation()) / level_W.squaredNorm();
  out.torque = std::copysign(load_.mean().torque.norm(), out.displacement);
  out.p_HCm = X_WH.inverse() * p_WCm;
  out.torque_about_handle = right_W.dot(load_.mean().torque);
  const Eigen::Vector3d said_W = X_WT_ * (reported.X_TH * Eigen::Vector3d(reported.displacement, 0, 0));
  const plant::Slip& slip = plant.slip(hand_, object_);
  out.slip = slip.travel;
  out.slip_turn = slip.turn;
  out.com_error = right_W.dot(said_W - X_WH.translation()) - out.displacement;
  return out;
}

bool Judge::held_now() const {
  const plant::Plant& plant = emulator_.plant();
  const double risen = plant.X_WO(object_).translation().z() - object_in_scene().X_WO.translation().z();
  return risen > kLiftedClear && !plant.object_touches_fixed(object_);
}

Eigen::Vector3d volume_centroid(const RobotModel& object) {
  constexpr double kStep = 0.004;  // m
  const std::vector<Eigen::Isometry3d> X_OL = link_poses(object, {});
  const std::vector<motion::BodyShape> shapes = motion::body_shapes(object);
  std::vector<Eigen::Isometry3d> X_SO;
  Eigen::AlignedBox3d box;
  for (const motion::BodyShape& shape : shapes) {
    const Eigen::Isometry3d X_OS = X_OL[static_cast<std::size_t>(shape.link)] * shape.X_LS;
    X_SO.push_back(X_OS.inverse());
    const Eigen::Vector3d reach =
        X_OS.linear().cwiseAbs() * shape.half + Eigen::Vector3d::Constant(shape.rounding);
    box.extend(X_OS.translation() + reach);
    box.extend(X_OS.translation() - reach);
  }
  const auto is_inside = [&](const Eigen::Vector3d& p_O) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Eigen::Vector3d p_S = X_SO[i] * p_O;
      if ((p_S - shapes[i].nearest_S(p_S)).norm() <= shapes[i].rounding) return true;
    }
    return false;
  };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  const Eigen::Array3d cells = (box.sizes().array() / kStep).ceil().max(1);
  const Eigen::Array3d step = box.sizes().array() / cells;
  for (int i = 0; i < cells.x(); ++i) {
    for (int j = 0; j < cells.y(); ++j) {
      for (int k = 0; k < cells.z(); ++k) {
        const Eigen::Vector3d p_O = box.min().array() + step * (Eigen::Array3d(i, j, k) + 0.5);
        if (!is_inside(p_O)) continue;
        sum += p_O;
        count += 1;
      }
    }
  }
  return count == 0 ? Eigen::Vector3d(box.center()) : Eigen::Vector3d(sum / count);
}

}  // namespace walkman::apps
