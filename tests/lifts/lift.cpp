#include "tests/lifts/lift.h"

#include "adaptation/wrench/carried_load.h"
#include "tests/rigs/commanded_robot.h"
#include "urdf/reader/kinematics.h"

namespace walkman::lifts {
namespace {

constexpr int kBar = 0;
constexpr double kRadius = 0.035;    // m, of the bar
constexpr double kSpacerMass = 0.1;  // kg; the two weights keep the bar 1 cm above the table
constexpr double kMinForce = 1.0;    // N

/// The scene's bar with the mass and the centre of mass of the case, its middle at its original place.
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
  // The spacers are equally far to the left and to the right.
  tube.p_LLcm = Eigen::Vector3d(lift.offset * lift.mass / mass, 0, 0);
  return scene;
}

double distance_to_line(const Eigen::Vector3d& point, const wrench::ComLine& line) {
  return (point - line.p_PF).cross(line.direction).norm();
}

/// Computes the errors of a mean load of the object about Ho in E, which is T or W; both have z up.
void judge(const Wrench& F_Ho_E, const Eigen::Vector3d& p_HoCm_E, double weight, double& force_error,
           double& line_error) {
  force_error = -F_Ho_E.force.z() / weight - 1;
  const auto line = wrench::com_line(F_Ho_E, kMinForce);
  line_error = line ? distance_to_line(p_HoCm_E, *line) : 1;
}

}  // namespace

LiftResult run_lift(const Scene& scene, const EmulatorOptions& options, const LiftCase& lift) {
  EmulatorOptions emulator = options;
  emulator.seed = lift.seed;
  rigs::CommandedRobot robot(with_bar(scene, lift), emulator);
  const int wrist = robot.sensor(robot.session().hand().force_torque);
  const int sensor_link = robot.model().link_index(robot.session().hand().force_torque);
  const std::vector<std::size_t> hand = links_below(robot.model(), static_cast<std::size_t>(sensor_link));
  const int palm = robot.model().link_index(robot.session().hand().frame);
  const SceneObject& bar = robot.scene().objects[kBar];
  LiftResult result;
  try {
    robot.start();
    const Eigen::Isometry3d X_TG = robot.X_TG_on_top(kBar, kRadius);
    regrasp::Manipulator& arm = robot.manipulator();
    arm.calibrate();
    robot.grasp(X_TG, kRadius, [&arm] { arm.tare(); });
    arm.lift();
    arm.turn();

    result.held = true;
    wrench::WrenchAverage truth;
    Eigen::Vector3d p_HoCm_W = Eigen::Vector3d::Zero(), p_HoCm_T = Eigen::Vector3d::Zero();
    const Eigen::Isometry3d X_PO = robot.plant().X_WL(palm).inverse() * robot.plant().X_WO(kBar);
    robot.each_cycle = [&] {
      const plant::Plant& plant = robot.plant();
      const Wrench& F_So_S = plant.F_So_S(wrist);
      const Eigen::Isometry3d X_WS = plant.X_WL(sensor_link);
      const Eigen::Isometry3d X_WP = plant.X_WL(palm);
      Wrench F_So_W{X_WS.linear() * F_So_S.torque, X_WS.linear() * F_So_S.force};
      for (const std::size_t i : hand) {
        const Link& link = robot.model().links[i];
        const Eigen::Vector3d own(0, 0, -link.mass * motion::kGravity);
        F_So_W.force -= own;
        F_So_W.torque -= (plant.X_WL(static_cast<int>(i)) * link.p_LLcm - X_WS.translation()).cross(own);
      }
      const Eigen::Vector3d p_WCm = plant.X_WO(kBar) * bar.p_OOcm();
      truth.add(wrench::shift(F_So_W, X_WP.translation() - X_WS.translation()));
      p_HoCm_W = p_WCm - X_WP.translation();
      p_HoCm_T = robot.X_WT().inverse() * p_WCm - robot.session().X_TH().translation();
      result.held = result.held && !plant.object_touches_fixed(kBar);
      const Eigen::Isometry3d now = X_WP.inverse() * plant.X_WO(kBar);
      result.slip = std::max(result.slip, (now.translation() - X_PO.translation()).norm());
    };
    const Wrench read = arm.weigh().F_Ho_T;
    const double weight = bar.mass() * motion::kGravity;
    judge(truth.mean(), p_HoCm_W, weight, result.force_error, result.line_error);
    judge(read, p_HoCm_T, weight, result.read_force_error, result.read_line_error);
  } catch (const regrasp::RunStopped& stop) {
    result.held = false;
    result.reason = stop.what();
  }
  return result;
}

}  // namespace walkman::lifts
