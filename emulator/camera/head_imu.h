#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "drivers/camera/multisense/imu_messages.h"
#include "drivers/time.h"
#include "emulator/camera/camera_parameters.h"
#include "emulator/plant/plant.h"

namespace walkman {

/// The inertial unit in the camera's head: three chips that sample the plant at their configured rates.
///
/// `advance` runs in the plant's thread, everything else in one other thread.
class HeadImu {
 public:
  HeadImu(const ImuErrors& errors, std::uint64_t seed);

  /// Call after each physics step; `motion`: of the unit's frame in that step.
  void advance(Time now, const plant::InertialMotion& motion);

  [[nodiscard]] static const multisense::ImuInfo& info();
  [[nodiscard]] multisense::ImuConfig config() const;
  /// Returns false, and changes nothing, for a setting that `info` does not offer.
  [[nodiscard]] bool set(const multisense::ImuConfig& wanted);
  /// Takes the next samples, enough to fill a message; returns false if there are fewer up to `until`.
  [[nodiscard]] bool take(Time until, multisense::ImuData& out);

 private:
  static constexpr std::size_t kChips = 3;
  struct Chip {
    Time next{};
    std::uint64_t count = 0;  // of its samples
    Eigen::Vector3d offset = Eigen::Vector3d::Zero(), filtered = Eigen::Vector3d::Zero();
    bool begun = false;
  };
  void sample(std::size_t chip, Time now, const Eigen::Vector3d& truth);

  ImuErrors errors_;
  std::uint64_t seed_;
  std::array<Chip, kChips> chips_;
  mutable std::mutex mutex_;  // guards the following
  multisense::ImuConfig config_;
  std::deque<multisense::ImuSample> samples_;
  std::uint32_t number_ = 0;
};

}  // namespace walkman
