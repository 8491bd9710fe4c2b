#include "tests/lifts/lift.h"

#include "adaptation/wrench/com_line.h"
#include "adaptation/wrench/hand_weight.h"
#include "adaptation/wrench/wrench_average.h"
#include "tests/rigs/commanded_robot.h"

namespace walkman::lifts {
namespace {

constexpr int kBar = 0;
constexpr double kRadius = 0.035;    // m, of the bar
constexpr double kSpacerMass = 0.1;  // kg; the two weights keep the bar 1 cm above the table
constexpr double kMinForce = 1.0;    // N

/// The bar of the scene with the mass and the centre of mass of the case, its middle where it lay.
Scene with_bar(Scene scene, const LiftCase& lift) {
  SceneObject& bar = scene.objects[kBar];
  for (AttachedWeight& weight : bar.weights) {
    Link& body = weight.model.links.front();
    body.I_LLcm_L *= kSpacerMass / body.mass;
    body.mass = kSpacerMass;
  }
  Link& tube = bar.model.links.front();
  const double mass = lift.mass - 2 * kSpacerMass;
  tube.I_LLcm_L *= mass / tube.mass;
  tube.mass = mass;
  // The spacers are as far to the left as to the right.
  tube.p_LLcm = Eigen::Vector3d(lift.offset * lift.mass / mass, 0, 0);
  return scene;
}

/// On top of the bar's middle, the hand square to it.
Eigen::Isometry3d grasp_frame(const Eigen::Isometry3d& X_TO) {
  Eigen::Isometry3d X_TG = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d right = X_TO.linear().col(0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  X_TG.linear() << right, up, right.cross(up);
  X_TG.translation() = X_TO.translation() + kRadius * up;
  return X_TG;
}

double distance_to_line(const Eigen::Vector3d& point, const wrench::ComLine& line) {
  return (point - line.foot).cross(line.direction).norm();
}

/// Judges a mean load of the object about Ho in T.
void judge(const Wrench& F_Ho_T, const Eigen::Vector3d& p_HoCm_T, double weight, double& force_error,
           double& line_error) {
  force_error = -F_Ho_T.force.z() / weight - 1;
  const auto line = wrench::com_line(F_Ho_T, kMinForce);
  line_error = line ? distance_to_line(p_HoCm_T, *line) : 1;
}

}  // namespace

LiftResult run_lift(const Scene& scene, const EmulatorOptions& options, const LiftCase& lift) {
  EmulatorOptions emulator = options;
  emulator.seed = lift.seed;
  rigs::CommandedRobot robot(with_bar(scene, lift), emulator);
  const wrench::HandWeight hand(robot.model(), robot.session().side().sensor_frame);
  const int wrist = robot.sensor(robot.session().side().sensor_frame);
  const int palm = robot.model().link_index(robot.session().side().grasp_frame);
  const SceneObject& bar = robot.scene().objects[kBar];
  LiftResult result;
  try {
    robot.start();
    const Eigen::Isometry3d X_TG = grasp_frame(robot.X_WT().inverse() * robot.plant().X_WO(kBar));
    regrasp::Manipulator& arm = robot.manipulator();
    arm.approach(X_TG);
    arm.tare();
    arm.grasp(X_TG);
    arm.lift();

    result.held = true;
    wrench::WrenchAverage truth;
    Eigen::Vector3d p_HoCm_T = Eigen::Vector3d::Zero();
    const Eigen::Isometry3d X_PO = robot.plant().X_WL(palm).inverse() * robot.plant().X_WO(kBar);
    robot.each_cycle = [&] {
      const motion::Kinematics& measured = robot.session().measured();
      const Wrench& F_So_S = robot.plant().F_So_S(wrist);
      const Wrench own = hand.F_So_S(measured);
      const Eigen::Isometry3d& X_TS = robot.session().X_TS();
      const Wrench F_So_T{X_TS.linear() * (F_So_S.torque - own.torque),
                          X_TS.linear() * (F_So_S.force - own.force)};
      const Eigen::Vector3d p_THo = robot.session().X_TH().translation();
      truth.add(wrench::shift(F_So_T, p_THo - X_TS.translation()));
      const Eigen::Isometry3d X_TO = robot.X_WT().inverse() * robot.plant().X_WO(kBar);
      p_HoCm_T = X_TO * bar.p_OOcm() - p_THo;
      result.held = result.held && !robot.plant().object_touches_fixed(kBar);
      const Eigen::Isometry3d now = robot.plant().X_WL(palm).inverse() * robot.plant().X_WO(kBar);
      result.slip = std::max(result.slip, (now.translation() - X_PO.translation()).norm());
    };
    const Wrench read = arm.weigh();
    const double weight = bar.mass() * motion::kGravity;
    judge(truth.mean(), p_HoCm_T, weight, result.force_error, result.line_error);
    judge(read, p_HoCm_T, weight, result.read_force_error, result.read_line_error);
  } catch (const regrasp::RunStopped& stop) {
    result.held = false;
    result.reason = stop.what();
  }
  return result;
}

}  // namespace walkman::lifts
