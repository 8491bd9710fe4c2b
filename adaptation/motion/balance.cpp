#include "adaptation/motion/balance.h"

namespace walkman::motion {
namespace {

constexpr double kLeastLoad = 50;  // N; with less, the quotient of moment and force is noise

}  // namespace

BalanceReading read_balance(const KinematicTree& measured, const Stance& stance,
                            const std::array<FootLoad, Stance::kFeet>& feet,
                            const Eigen::Vector3d& up_T) noexcept {
  BalanceReading reading;
  double total = 0;
  double ground = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();  // load times the position of its centre
  for (int foot = 0; foot < Stance::kFeet; ++foot) {
    const FootLoad& sensed = feet[static_cast<std::size_t>(foot)];
    const Eigen::Isometry3d& X_TS = measured.X_WL(sensed.sensor_link);
    const Eigen::Vector3d f = X_TS.linear() * sensed.F_So_S.force;
    const Eigen::Vector3d t = X_TS.linear() * sensed.F_So_S.torque;
    const double sole = stance.X_TF(foot).translation().z();
    const double below = sole - X_TS.translation().z();
    // The ground point about which the force has only a vertical moment, times the load.
    moment +=
        f.z() * X_TS.translation().head<2>() + Eigen::Vector2d(below * f.x() - t.y(), below * f.y() + t.x());
    reading.load[static_cast<std::size_t>(foot)] = f.z();
    reading.force_T += f.head<2>();
    total += f.z();
    ground += sole / Stance::kFeet;
  }
  const Eigen::Vector3d& com = measured.com();
  reading.p_Tcm = com.head<2>() - (com.z() - ground) * up_T.head<2>();
  reading.p_Tcp = total > kLeastLoad ? Eigen::Vector2d(moment / total) : reading.p_Tcm;
  return reading;
}

}  // namespace walkman::motion
