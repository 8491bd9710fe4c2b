#include "emulator/camera/head_imu.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman {
namespace {

using multisense::ImuConfig, multisense::ImuInfo, multisense::ImuKind;

enum Term : std::uint64_t { kOffset = 48, kNoise };  // the camera's and the laser's terms come before

constexpr std::size_t kKept = 4096;  // samples kept when nobody takes them
constexpr double kDegree = std::numbers::pi / 180;
// The Earth's magnetic field in northern Italy, with W's x pointing north: 0.47 gauss, 62 degrees downwards.
const Eigen::Vector3d kField_W(0.22, 0, -0.415);  // gauss
constexpr double kG = 9.80665;                    // m/s²

ImuInfo make_info() {
  ImuInfo info;
  info.sensors = {{"accelerometer",
                   "lsm303",
                   "g",
                   {{10, 1}, {25, 3}, {50, 6}, {100, 11}, {200, 22}, {400, 44}, {1344, 150}},
                   {{2, 0.001F}, {4, 0.002F}, {8, 0.004F}, {16, 0.012F}}},
                  {"gyroscope",
                   "l3g",
                   "dps",
                   {{100, 13}, {200, 13}, {200, 25}, {400, 25}, {400, 50}, {800, 50}, {800, 110}},
                   {{250, 0.009F}, {500, 0.018F}, {2000, 0.070F}}},
                  {"magnetometer",
                   "lsm303",
                   "gauss",
                   {{10, 5}, {25, 12.5F}, {50, 25}, {100, 50}},
                   {{1.3F, 0.00102F},
                    {1.9F, 0.001316F},
                    {2.5F, 0.001667F},
                    {4.0F, 0.0025F},
                    {4.7F, 0.002817F},
                    {5.6F, 0.00339F},
                    {8.1F, 0.004878F}}}};
  return info;
}

}  // namespace

const ImuInfo& HeadImu::info() {
  static const ImuInfo info = make_info();
  return info;
}

HeadImu::HeadImu(const ImuErrors& errors, std::uint64_t seed) : errors_(errors), seed_(seed) {
  config_.samples_per_message = 30;
  for (const ImuInfo::Sensor& sensor : info().sensors)
    config_.sensors.push_back({sensor.name, ImuConfig::kEnabled, 0, 0});
  config_.sensors[0].rate = 4;
  config_.sensors[1].rate = 1;
  config_.sensors[2].rate = 3;
  const std::array<double, kChips> most{errors.force_offset, errors.rate_offset, errors.field_offset};
  for (std::size_t chip = 0; chip < kChips; ++chip) {
    const sensors::RandomStream random(seed, chip, kOffset, 0);
    for (int axis = 0; axis < 3; ++axis) {
      const double share = 2 * static_cast<double>(random.uniform(static_cast<std::uint64_t>(axis))) - 1;
      chips_[chip].offset[axis] = most[chip] * share;
    }
  }
}

void HeadImu::advance(Time now, const plant::InertialMotion& motion) {
  const Eigen::Vector3d& w = motion.angular_velocity_S;
  const std::array<Eigen::Vector3d, kChips> truth{motion.specific_force_S / kG,
                                                  Eigen::Vector3d(-w.y(), w.x(), w.z()) / kDegree,
                                                  motion.q_WS.conjugate() * kField_W};
  const std::lock_guard lock(mutex_);
  for (std::size_t chip = 0; chip < kChips; ++chip) sample(chip, now, truth[chip]);
}

void HeadImu::sample(std::size_t chip, Time now, const Eigen::Vector3d& truth) {
  const ImuConfig::Sensor& set = config_.sensors[chip];
  const ImuInfo::Sensor& kind = info().sensors[chip];
  const ImuInfo::Pair& rate = kind.rates[set.rate];
  const ImuInfo::Pair& range = kind.ranges[set.range];
  Chip& own = chips_[chip];
  // The chip's own low-pass filter, at the plant's rate of 1 kHz.
  const double cutoff = 2 * std::numbers::pi * static_cast<double>(rate.second);
  const double gain = own.begun ? 1 - std::exp(-cutoff * plant::Plant::kStep) : 1;
  own.begun = true;
  own.filtered += gain * (truth - own.filtered);
  if ((set.flags & ImuConfig::kEnabled) == 0) {
    own.next = now;
    return;
  }
  const auto period = Time(std::llround(1e9 / static_cast<double>(rate.first)));
  // A chip set to more samples than the plant provides delivers what the plant provides.
  if (now < own.next) return;
  own.next = std::max(own.next + period, now + period - std::chrono::milliseconds(1));
  std::array<float, 3> draw{};
  sensors::fill_normal(sensors::RandomStream(seed_, chip, kNoise, own.count++), draw);
  const double bandwidth = std::sqrt(static_cast<double>(rate.second) * std::numbers::pi / 2);
  const std::array<double, kChips> noise{errors_.force_noise * bandwidth, errors_.rate_noise * bandwidth,
                                         errors_.field_noise};
  multisense::ImuSample out;
  out.kind = static_cast<ImuKind>(chip + 1);
  out.nanoseconds = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double value = own.filtered[i] + own.offset[i] + noise[chip] * static_cast<double>(draw[axis]);
    const auto step = static_cast<double>(range.second), most = static_cast<double>(range.first);
    out.value[axis] = static_cast<float>(step * std::round(std::clamp(value, -most, most) / step));
  }
  samples_.push_back(out);
  if (samples_.size() > kKept) samples_.pop_front();
}

ImuConfig HeadImu::config() const {
  const std::lock_guard lock(mutex_);
  return config_;
}

bool HeadImu::set(const ImuConfig& wanted) {
  const std::lock_guard lock(mutex_);
  ImuConfig next = config_;
  if (wanted.samples_per_message > info().most_samples) return false;
  if (wanted.samples_per_message > 0) next.samples_per_message = wanted.samples_per_message;
  for (const ImuConfig::Sensor& sensor : wanted.sensors) {
    const auto found = std::find_if(next.sensors.begin(), next.sensors.end(),
                                    [&](const ImuConfig::Sensor& one) { return one.name == sensor.name; });
    if (found == next.sensors.end()) return false;
    const ImuInfo::Sensor& kind = info().sensors[static_cast<std::size_t>(found - next.sensors.begin())];
    if (sensor.rate >= kind.rates.size() || sensor.range >= kind.ranges.size()) return false;
    *found = sensor;
  }
  config_ = next;
  return true;
}

bool HeadImu::take(Time until, multisense::ImuData& out) {
  const std::lock_guard lock(mutex_);
  const std::size_t full = config_.samples_per_message;
  if (samples_.size() < full || Time(samples_[full - 1].nanoseconds) > until) return false;
  const auto end = samples_.begin() + static_cast<std::ptrdiff_t>(config_.samples_per_message);
  out.number = ++number_;
  out.samples.assign(samples_.begin(), end);
  samples_.erase(samples_.begin(), end);
  return true;
}

}  // namespace walkman
