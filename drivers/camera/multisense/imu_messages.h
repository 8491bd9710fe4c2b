#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/camera/multisense/wire.h"

/// Messages of a MultiSense's inertial unit: an accelerometer and magnetometer in one chip, and a gyroscope
/// in another that is rotated by 90° about z: in the accelerometer's axes, the angular velocity is (y, −x, z)
/// of the gyroscope's reading. Values in g, degrees per second, gauss.
namespace walkman::multisense {

/// A list with its prefix: version of the elements, and their number. Lists of more than `most` are not read.
template <typename Element>
void list_field(auto& list, auto& archive, std::uint16_t version, std::uint32_t most) {
  auto count = static_cast<std::uint32_t>(list.size());
  archive(version, count);
  if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
    if (count > most) {
      static_cast<void>(archive.raw(SIZE_MAX));  // marks the message as incomplete
      return;
    }
    list.resize(count);
  }
  for (auto& element : list) Element::fields(element, archive, version);
}

enum class ImuKind : std::uint16_t { kAccelerometer = 1, kGyroscope = 2, kMagnetometer = 3 };

struct ImuSample {
  ImuKind kind = ImuKind::kAccelerometer;
  std::int64_t nanoseconds = 0;  ///< on the sensor's clock
  std::array<float, 3> value{};
  static void fields(auto& self, auto& archive, std::uint16_t version) {
    archive(self.kind, self.nanoseconds, self.value);
    std::uint64_t ptp_nanoseconds = 0;
    if (version >= 2) archive(ptp_nanoseconds);
  }
};

struct ImuData {
  static constexpr std::uint16_t kId = 0x0114, kVersion = 1;
  static constexpr std::uint32_t kMostSamples = 300;
  std::uint32_t number = 0;  ///< incremented with each message
  std::vector<ImuSample> samples;
  static void fields(auto& self, auto& archive) {
    archive(self.number);
    // Firmware before 6.10 has no precision time, and clients of its age read samples of this version only.
    list_field<ImuSample>(self.samples, archive, 1, kMostSamples);
  }
};

/// Available settings of the unit.
struct ImuInfo {
  static constexpr std::uint16_t kId = 0x0115, kVersion = 1;
  static constexpr std::uint32_t kMostSettings = 64;
  struct Pair {
    float first = 0, second = 0;
    static void fields(auto& self, auto& archive, std::uint16_t) { archive(self.first, self.second); }
  };
  struct Sensor {
    std::string name, device, units;
    std::vector<Pair> rates;   ///< rate and cut-off frequency, Hz
    std::vector<Pair> ranges;  ///< plus and minus limit, and size of one step
    static void fields(auto& self, auto& archive, std::uint16_t) {
      archive(self.name, self.device, self.units);
      list_field<Pair>(self.rates, archive, 1, kMostSettings);
      list_field<Pair>(self.ranges, archive, 1, kMostSettings);
    }
  };
  std::uint32_t most_samples = ImuData::kMostSamples;
  std::vector<Sensor> sensors;
  static void fields(auto& self, auto& archive) {
    archive(self.most_samples);
    list_field<Sensor>(self.sensors, archive, 1, kMostSettings);
  }
};

struct ImuConfig {
  static constexpr std::uint16_t kId = 0x0116, kVersion = 1;
  static constexpr std::uint32_t kMostSensors = 16;
  static constexpr std::uint32_t kEnabled = 1;
  struct Sensor {
    std::string name;
    std::uint32_t flags = kEnabled, rate = 0, range = 0;  ///< rate and range: indices into ImuInfo's lists
    static void fields(auto& self, auto& archive, std::uint16_t) {
      archive(self.name, self.flags, self.rate, self.range);
    }
  };
  bool store = false;
  std::uint32_t samples_per_message = 0;  ///< 0 in a request: unchanged
  std::vector<Sensor> sensors;
  static void fields(auto& self, auto& archive) {
    archive(self.store, self.samples_per_message);
    list_field<Sensor>(self.sensors, archive, 1, kMostSensors);
  }
};

}  // namespace walkman::multisense
