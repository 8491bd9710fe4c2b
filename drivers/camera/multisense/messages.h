#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/multisense/wire.h"
#include "drivers/time.h"

/// The messages of a MultiSense-SL, as its vendor's client library reads and writes them. Units are those of
/// the wire: seconds and microseconds, metres, pixels, microradians.
namespace walkman::multisense {

/// Image sources as named in a stream's mask and in an image, one bit each.
namespace source {
inline constexpr std::uint64_t kLumaLeft = 1U << 2U;
inline constexpr std::uint64_t kLumaRight = 1U << 3U;
inline constexpr std::uint64_t kLumaRectifiedLeft = 1U << 4U;
inline constexpr std::uint64_t kLumaRectifiedRight = 1U << 5U;
inline constexpr std::uint64_t kDisparityLeft = 1U << 10U;
inline constexpr std::uint64_t kLidar = 1U << 24U;
inline constexpr std::uint64_t kImu = 1U << 25U;
inline constexpr std::uint64_t kEverything = 0x0000000F'FF7FFFFF;
}  // namespace source

/// Requests that consist of an id only.
enum class Query : std::uint16_t {
  kVersion = 0x0002,
  kStatus = 0x0003,
  kCameraConfig = 0x0004,
  kLighting = 0x0012,
  kDeviceInfo = 0x0017,
  kCameraCalibration = 0x0018,
  kLidarCalibration = 0x0019,
  kMtu = 0x001A,
  kNetwork = 0x001B,
  kDeviceModes = 0x001D,
  kImuInfo = 0x001F,
  kImuConfig = 0x0020,
  kExternalCalibration = 0x0024,
  kTransmitDelay = 0x0027,
  kMotorPosition = 0x0028,
};
[[nodiscard]] std::vector<std::uint8_t> encode(Query query);

struct Ack {
  static constexpr std::uint16_t kId = 0x0001, kVersion = 1;
  enum Status : std::int32_t { kOk = 0, kFailed = -3, kUnsupported = -4, kUnknown = -5 };
  std::uint16_t request = 0;
  std::int32_t status = kOk;
  static void fields(auto& self, auto& archive) { archive(self.request, self.status); }
};

/// A time on the sensor's own clock.
struct SensorTime {
  std::uint32_t seconds = 0, microseconds = 0;
};
[[nodiscard]] Time time_of(const SensorTime& t);
[[nodiscard]] SensorTime sensor_time(Time t);
/// Converts an angle (rad) to the wire format of the spindle angle: within half a turn of 0.
[[nodiscard]] std::int32_t microradians(double angle);

struct Version {
  static constexpr std::uint16_t kId = 0x0102, kVersion = 1;
  std::string build_date;
  std::uint16_t firmware = 0;  ///< major in the high byte, minor in the low one
  std::uint64_t hardware = 0, magic = 0, fpga_dna = 0;
  static void fields(auto& self, auto& archive) {
    archive(self.build_date, self.firmware, self.hardware, self.magic, self.fpga_dna);
  }
};

struct Status {
  static constexpr std::uint16_t kId = 0x0103, kVersion = 3;
  static constexpr std::uint32_t kAllWell = 0x7F;
  SensorTime uptime;
  std::uint32_t health = 0;
  float cpu_temperature_c = 0, fpga_temperature_c = 0;
  std::array<float, 2> imager_temperature_c{-99999, -99999};  ///< default: not available
  float input_voltage = -1, input_current = -1;               ///< V, A; default: not available
  std::array<float, 3> power{-1, -1, -1};                     ///< W; default: not available
  static void fields(auto& self, auto& archive) {
    archive(self.uptime.seconds, self.uptime.microseconds, self.health, self.cpu_temperature_c,
            self.fpga_temperature_c);
    if (archive.since(2))
      archive(self.imager_temperature_c, self.input_voltage, self.input_current, self.power);
  }
};

/// The answer to Query::kDeviceInfo, and the request that stores it.
struct DeviceInfo {
  static constexpr std::uint16_t kId = 0x010C, kVersion = 1;
  static constexpr std::uint8_t kMostBoards = 8;
  struct Board {
    std::string name;
    std::uint32_t revision = 0;
  };
  std::string key, name, build_date, serial_number;
  std::uint32_t hardware_revision = 1;  ///< MultiSense-SL
  std::vector<Board> boards;
  std::string imager_name;
  std::uint32_t imager_type = 0, imager_width = 0, imager_height = 0;
  std::string lens_name;
  std::uint32_t lens_type = 0;
  float baseline = 0, focal_length = 0, aperture = 0;  ///< m, m, nominal
  std::uint32_t lighting_type = 0, lights = 0;
  std::string laser_name;
  std::uint32_t laser_type = 0;
  std::string motor_name;
  std::uint32_t motor_type = 0;
  float gear_reduction = 0;
  static void fields(auto& self, auto& archive) {
    archive(self.key, self.name, self.build_date, self.serial_number, self.hardware_revision);
    auto count = static_cast<std::uint8_t>(self.boards.size());
    archive(count);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      if (count > kMostBoards) {
        static_cast<void>(archive.raw(SIZE_MAX));  // marks the message as incomplete
        return;
      }
      self.boards.resize(count);
    }
    for (auto& board : self.boards) archive(board.name, board.revision);
    archive(self.imager_name, self.imager_type, self.imager_width, self.imager_height, self.lens_name,
            self.lens_type, self.baseline, self.focal_length, self.aperture, self.lighting_type, self.lights,
            self.laser_name, self.laser_type, self.motor_name, self.motor_type, self.gear_reduction);
  }
};

struct DeviceModes {
  static constexpr std::uint16_t kId = 0x0112, kVersion = 3;
  static constexpr std::uint32_t kMost = 256;
  struct Mode {
    std::uint32_t width = 0, height = 0, sources = 0, disparities = 0, more_sources = 0;
  };
  std::vector<Mode> modes;
  static void fields(auto& self, auto& archive) {
    auto count = static_cast<std::uint32_t>(self.modes.size());
    archive(count);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) self.modes.resize(std::min(count, kMost));
    for (auto& mode : self.modes) archive(mode.width, mode.height, mode.sources, mode.disparities);
    if (!archive.since(3)) return;
    for (auto& mode : self.modes) archive(mode.more_sources);
  }
};

/// Calibration of the full imager: consumers scale it to the current mode. The answer to
/// Query::kCameraCalibration, and the request that stores it.
struct CameraCalibration {
  static constexpr std::uint16_t kId = 0x010D, kVersion = 2;
  struct Camera {
    std::array<float, 9> M{};   ///< raw camera matrix, row-major
    std::array<float, 8> D{};   ///< k1 k2 p1 p2 k3 k4 k5 k6
    std::array<float, 9> R{};   ///< rectifying rotation
    std::array<float, 12> P{};  ///< rectified projection; right: [0][3] = −fx · baseline, px·m
  };
  Camera left, right, aux;  ///< `aux` does not exist: all zero
  static void fields(auto& self, auto& archive) {
    for (auto* camera : {&self.left, &self.right}) archive(camera->M, camera->D, camera->R, camera->P);
    if (archive.since(2)) archive(self.aux.M, self.aux.D, self.aux.R, self.aux.P);
  }
};

/// Settings common to the camera's configuration and its control message.
struct ExposureSettings {
  float gain = 1;
  std::uint32_t exposure_us = 5000;
  bool automatic = true;
  std::uint32_t longest_us = 20000, decay = 7;
  float threshold = 0.75F;
  float white_balance_red = 1, white_balance_blue = 1;
  bool automatic_white_balance = false;
  std::uint32_t white_balance_decay = 3;
  float white_balance_threshold = 0.5F;
  float post_filter = 0.85F;
  bool hdr = false;
  std::array<std::uint16_t, 4> region{};
  std::uint32_t profile = 0;
  std::uint32_t exposure_source = 4;
  std::uint16_t secondary_version = 2;
  std::uint32_t secondary_count = 0;
  float target_intensity = 0.5F, gamma = 2;
  bool sharpening = false;
  float sharpening_percent = 0;
  std::uint8_t sharpening_limit = 0;
  float most_gain = 1000;

  /// Fields after the frame rate, in every version.
  static void first_fields(auto& self, auto& archive) {
    archive(self.gain, self.exposure_us, self.automatic, self.longest_us, self.decay, self.threshold,
            self.white_balance_red, self.white_balance_blue, self.automatic_white_balance,
            self.white_balance_decay, self.white_balance_threshold);
  }

  /// Fields from version 5 on; the secondary exposures of other models are not read.
  static void later_fields(auto& self, auto& archive) {
    if (archive.since(5)) archive(self.region);
    if (archive.since(6)) archive(self.profile);
    if (archive.since(7)) archive(self.exposure_source, self.secondary_version, self.secondary_count);
    if (self.secondary_count > 0) return;
    if (archive.since(8)) archive(self.target_intensity, self.gamma);
    if (archive.since(9)) archive(self.sharpening, self.sharpening_percent, self.sharpening_limit);
    if (archive.since(10)) archive(self.most_gain);
  }
};

struct CameraConfig {
  static constexpr std::uint16_t kId = 0x0104, kVersion = 10;
  std::uint16_t width = 0, height = 0;
  float frames_per_second = 0;
  ExposureSettings exposure;
  float fx = 0, fy = 0, cx = 0, cy = 0;   ///< of the rectified pair at this size, px
  std::array<float, 3> translation{};     ///< m
  std::array<float, 3> roll_pitch_yaw{};  ///< rad
  std::int32_t disparities = 0;
  static void fields(auto& self, auto& archive) {
    auto& e = self.exposure;
    archive(self.width, self.height, self.frames_per_second);
    ExposureSettings::first_fields(e, archive);
    archive(self.fx, self.fy, self.cx, self.cy, self.translation, self.roll_pitch_yaw);
    if (archive.since(2)) archive(self.disparities);
    if (archive.since(3)) archive(e.post_filter);
    if (archive.since(4)) archive(e.hdr);
    ExposureSettings::later_fields(e, archive);
  }
};

struct CameraControl {
  static constexpr std::uint16_t kId = 0x0007, kVersion = 10;
  float frames_per_second = 0;
  ExposureSettings exposure;
  bool store = false;
  static void fields(auto& self, auto& archive) {
    auto& e = self.exposure;
    archive(self.frames_per_second);
    ExposureSettings::first_fields(e, archive);
    if (archive.since(2)) archive(e.post_filter);
    if (archive.since(3)) archive(e.hdr);
    if (archive.since(4)) archive(self.store);
    ExposureSettings::later_fields(e, archive);
  }
};

struct Resolution {
  static constexpr std::uint16_t kId = 0x000C, kVersion = 3;
  std::uint32_t width = 0, height = 0;
  std::int32_t disparities = 0, mode = 0, offset = -1;
  static void fields(auto& self, auto& archive) {
    archive(self.width, self.height);
    if (archive.since(2)) archive(self.disparities);
    if (archive.since(3)) archive(self.mode, self.offset);
  }
};

/// What triggers an exposure.
struct Trigger {
  static constexpr std::uint16_t kId = 0x001E, kVersion = 1;
  static constexpr std::uint32_t kInternal = 0;
  std::uint32_t source = kInternal;
  static void fields(auto& self, auto& archive) { archive(self.source); }
};

struct Network {
  static constexpr std::uint16_t kId = 0x0016, kVersion = 1;
  std::uint8_t interface = 1;
  std::string address, gateway, netmask;  ///< dotted quads
  static void fields(auto& self, auto& archive) {
    archive(self.interface, self.address, self.gateway, self.netmask);
  }
};

/// The answer to Query::kTransmitDelay, and the request that sets it.
struct TransmitDelay {
  static constexpr std::uint16_t kId = 0x0026, kVersion = 1;
  std::int32_t milliseconds = 0;
  static void fields(auto& self, auto& archive) { archive(self.milliseconds); }
};

/// Pose of the left optical frame in a user-defined frame.
struct ExternalCalibration {
  static constexpr std::uint16_t kId = 0x011B, kVersion = 1;
  std::array<float, 3> translation{};     ///< m
  std::array<float, 3> roll_pitch_yaw{};  ///< rad
  static void fields(auto& self, auto& archive) { archive(self.translation, self.roll_pitch_yaw); }
};

/// Settings of the lights around the cameras.
struct LightSettings {
  std::array<std::uint8_t, 8> intensity{};
  std::uint8_t flash = 0;
  std::uint32_t delay_us = 0, pulses = 0;
  std::uint8_t invert = 0, rolling_shutter = 0;
  static void fields(auto& self, auto& archive) {
    archive(self.intensity, self.flash);
    if (archive.since(2)) archive(self.delay_us, self.pulses);
    if (archive.since(3)) archive(self.invert);
    if (archive.since(4)) archive(self.rolling_shutter);
  }
};

struct Lights {
  static constexpr std::uint16_t kId = 0x010A, kVersion = 4;
  std::uint8_t available = 0;  ///< a bit for each light
  LightSettings settings;
  static void fields(auto& self, auto& archive) {
    archive(self.available);
    LightSettings::fields(self.settings, archive);
  }
};

struct SetLights {
  static constexpr std::uint16_t kId = 0x0013, kVersion = 4;
  std::uint8_t changed = 0;  ///< a bit for each light
  LightSettings settings;
  static void fields(auto& self, auto& archive) {
    archive(self.changed);
    LightSettings::fields(self.settings, archive);
  }
};

/// New mask = (old & ~modify) | (control & modify).
struct StreamControl {
  static constexpr std::uint16_t kId = 0x001C, kVersion = 2;
  std::uint64_t modify = 0, control = 0;
  static void fields(auto& self, auto& archive) {
    auto low_modify = static_cast<std::uint32_t>(self.modify);
    auto low_control = static_cast<std::uint32_t>(self.control);
    auto high_modify = static_cast<std::uint32_t>(self.modify >> 32U);
    auto high_control = static_cast<std::uint32_t>(self.control >> 32U);
    archive(low_modify, low_control);
    if (archive.since(2)) archive(high_modify, high_control);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      self.modify = std::uint64_t{high_modify} << 32U | low_modify;
      self.control = std::uint64_t{high_control} << 32U | low_control;
    }
  }
};

/// The answer to Query::kMtu, and the request that sets the MTU.
struct Mtu {
  static constexpr std::uint16_t kId = 0x0014, kVersion = 1;
  std::uint32_t bytes = 0;
  static void fields(auto& self, auto& archive) { archive(self.bytes); }
};

struct MtuTest {
  static constexpr std::uint16_t kId = 0x0021, kVersion = 1;
  std::uint32_t mtu = 0;
  static void fields(auto& self, auto& archive) { archive(self.mtu); }
};

/// Fills one datagram.
struct MtuAnswer {
  static constexpr std::uint16_t kId = 0x0117, kVersion = 1;
  std::vector<std::uint8_t> filler;
  static void fields(auto& self, auto& archive) {
    auto count = static_cast<std::uint32_t>(self.filler.size());
    archive(count);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      const auto bytes = archive.raw(count);
      self.filler.assign(bytes.begin(), bytes.end());
    } else {
      archive.raw(self.filler);
    }
  }
};

/// Metadata of a frame; precedes its images.
struct ImageMetadata {
  static constexpr std::uint16_t kId = 0x010F, kVersion = 2;
  std::int64_t frame = 0;
  float frames_per_second = 0, gain = 1;
  std::uint32_t exposure_us = 0;
  SensorTime captured;
  std::int32_t spindle_microradians = 0;
  std::array<std::uint32_t, 1024> histogram{};
  std::uint64_t ptp_nanoseconds = 0;
  static void fields(auto& self, auto& archive) {
    archive(self.frame, self.frames_per_second, self.gain, self.exposure_us, self.captured.seconds,
            self.captured.microseconds, self.spindle_microradians, self.histogram);
    if (archive.since(2)) archive(self.ptp_nanoseconds);
  }
};

/// Image from one source, `bits` per pixel.
struct Image {
  static constexpr std::uint16_t kId = 0x0110, kVersion = 3;
  static constexpr std::uint32_t kMostBits = 64;
  std::uint64_t source = 0;
  std::uint32_t bits = 8;
  std::int64_t frame = 0;
  std::uint16_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  ///< rows from the top, without padding
  std::uint32_t exposure_us = 0;
  float gain = 1;
  static void fields(auto& self, auto& archive) {
    auto low = static_cast<std::uint32_t>(self.source);
    auto high = static_cast<std::uint32_t>(self.source >> 32U);
    archive(low, self.bits, self.frame, self.width, self.height);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      const std::uint64_t bits = std::uint64_t{self.width} * self.height * std::min(self.bits, kMostBits + 1);
      const auto bytes = archive.raw(self.bits > kMostBits ? SIZE_MAX : (bits + 7) / 8);
      self.pixels.assign(bytes.begin(), bytes.end());
    } else {
      archive.raw(self.pixels);
    }
    if (archive.since(2)) archive(self.exposure_us, self.gain);
    if (archive.since(3)) archive(high);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads)
      self.source = std::uint64_t{high} << 32U | low;
  }
};

/// Homogeneous transforms, row-major, m. The answer to Query::kLidarCalibration, and the request that stores
/// it.
struct LidarCalibration {
  static constexpr std::uint16_t kId = 0x010E, kVersion = 1;
  std::array<float, 16> X_SpL{};  ///< laser frame in the spindle frame, which turns about its z axis
  std::array<float, 16> X_CSp{};  ///< spindle frame at angle 0 in the left optical frame
  static void fields(auto& self, auto& archive) { archive(self.X_SpL, self.X_CSp); }
};

/// Sets the spindle's rate.
struct SetMotor {
  static constexpr std::uint16_t kId = 0x0010, kVersion = 1;
  float rpm = 0;
  static void fields(auto& self, auto& archive) { archive(self.rpm); }
};

struct MotorPosition {
  static constexpr std::uint16_t kId = 0x011D, kVersion = 1;
  std::int32_t microradians = 0;
  static void fields(auto& self, auto& archive) { archive(self.microradians); }
};

/// One turn of the laser's mirror: 270° about its y axis, starting at −135°; at mirror angle m the beam
/// points along (sin m, 0, cos m).
struct LidarData {
  static constexpr std::uint16_t kId = 0x0109, kVersion = 1;
  static constexpr double kArc = 4.712388;           ///< rad
  static constexpr std::uint32_t kNoReturn = 65535;  ///< anything beyond the range of 30 000 mm
  static constexpr std::uint32_t kMostRange = 30000;
  static constexpr std::uint32_t kMostPoints = 4096;
  std::uint32_t number = 0;
  SensorTime first, last;                                      ///< times of the first and last point
  std::int32_t first_microradians = 0, last_microradians = 0;  ///< spindle angles at these times
  std::vector<std::uint32_t> ranges_mm, intensities;
  static void fields(auto& self, auto& archive) {
    auto count = static_cast<std::uint32_t>(self.ranges_mm.size());
    archive(self.number, self.first.seconds, self.first.microseconds, self.last.seconds,
            self.last.microseconds, self.first_microradians, self.last_microradians, count);
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      if (count > kMostPoints) {
        static_cast<void>(archive.raw(SIZE_MAX));  // marks the message as incomplete
        return;
      }
      self.ranges_mm.resize(count);
      self.intensities.resize(count);
    }
    archive(self.ranges_mm, self.intensities);
  }
};

/// Disparity image: 12 bits per pixel, in units of 1/16 px at this width; 0: no match. Left pixel u matches
/// right pixel u − d.
struct Disparity {
  static constexpr std::uint16_t kId = 0x0111, kVersion = 1;
  static constexpr std::size_t kHeadBytes = 16;
  static constexpr float kStep = 1.0F / 16;  ///< px
  static constexpr std::uint16_t kLargest = 4095;
  std::int64_t frame = 0;
  std::uint16_t width = 0, height = 0;
  std::vector<std::uint16_t> pixels;  ///< row-major, in units of kStep
};
/// Writes an image's disparities (px), each rounded to the nearest step, up to the largest.
void quantize(std::span<const float> disparities, std::vector<std::uint16_t>& pixels);
/// `image` must have an even number of pixels.
[[nodiscard]] std::vector<std::uint8_t> encode(const Disparity& image);
/// Decodes into `image`, reusing its memory; returns false if this is not a disparity image, or if it has
/// more or fewer pixels than it states.
[[nodiscard]] bool decode(std::span<const std::uint8_t> message, Disparity& image);

}  // namespace walkman::multisense
