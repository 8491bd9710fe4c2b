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

/// The inertial unit in the camera's head: three chips that sample the plant at the rates they are set to.
///
/// `advance` runs with the plant, the rest in one other thread.
class HeadImu {
 public:
  HeadImu(const ImuErrors& errors, std::uint64_t seed);

  /// After each physics step: `motion` of the unit's frame in it.
  void advance(Time now, const plant::InertialMotion& motion);

  [[nodiscard]] static const multisense::ImuInfo& info();
  [[nodiscard]] multisense::ImuConfig config() const;
  /// False for what `info` does not offer; then nothing changes.
  [[nodiscard]] bool set(const multisense::ImuConfig& wanted);
  /// The next samples, a message full of them; false when there are not so many up to `until`.
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
  mutable std::mutex mutex_;  // of the following
  multisense::ImuConfig config_;
  std::deque<multisense::ImuSample> samples_;
  std::uint32_t number_ = 0;
};

}  // namespace walkman
