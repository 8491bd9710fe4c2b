#include "emulator/camera/camera_parameters.h"

#include <numbers>

#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

// A UTM-30LX-EW scans 270 degrees of a turn of 25 ms (SCIP 2.0), which is not transmitted on the wire.
constexpr int kMostBeams = 1081;
constexpr double kArc = 1.5 * std::numbers::pi, kArcTime = 0.01875;  // rad, s

sensors::StereoOptions read_stereo(const YamlMap& map) {
  sensors::StereoOptions o;
  o.width = static_cast<int>(map.integer("width", 16, 4096));
  o.height = static_cast<int>(map.integer("height", 16, 4096));
  o.focal_px = map.number("focal_px", 1, 1e5);
  o.cx = map.number("cx", 0, 4096);
  o.cy = map.number("cy", 0, 4096);
  o.baseline = map.number("baseline_m", 1e-3, 10);
  o.min_depth = map.number("min_depth_m", 1e-3, 10);
  o.max_disparity = static_cast<int>(map.integer("max_disparity", 1, 256));
  o.sigma_d = map.number("sigma_d_px", 0, 10);
  o.correlation_px = map.number("correlation_px", 0, 64);
  o.locking = map.number("locking_px", 0, 0.15);
  o.fattening_px = static_cast<int>(map.integer("fattening_px", 0, 64));
  o.spike_fraction = map.number("spike_fraction", 0, 0.2);
  o.dropout_fraction = map.number("dropout_fraction", 0, 0.9);
  o.disparity_step = map.number("disparity_step_px", 0, 1);
  return o;
}

sensors::LidarOptions read_laser(const YamlMap& map) {
  sensors::LidarOptions o;
  o.beams = static_cast<int>(map.integer("beams", 2, kMostBeams));
  o.step = kArc / (o.beams - 1);
  o.beam_period = kArcTime / (o.beams - 1);
  o.least_range = map.number("least_range_m", 0, 10);
  o.most_range = map.number("most_range_m", o.least_range + 0.1, 1000);
  o.beam_angle = map.number("beam_angle_rad", 0, 0.1);
  o.beam_radius = map.number("beam_radius_m", 0, 0.1);
  o.noise = map.number("noise_m", 0, 1);
  o.noise_far = map.number("noise_far_m", 0, 1);
  o.noise_grazing = map.number("noise_grazing_m", 0, 1);
  o.bias = map.number("bias_m", 0, 1);
  o.pulse = map.number("pulse_m", 0, 10);
  o.least_reflectance = map.number("least_reflectance", 0, 1);
  o.intensity = map.number("intensity", 0, 1e6);
  return o;
}

}  // namespace

CameraParameters CameraParameters::noise_free() const {
  return {stereo.noise_free(), rate_hz, laser.noise_free(), {0, 0, 0, 0, 0, 0}};
}

CameraParameters load_camera_parameters(const std::filesystem::path& yaml_file) {
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "", {"stereo", "laser", "imu"});
  const YamlMap stereo =
      top.map("stereo", {"width", "height", "rate_hz", "focal_px", "cx", "cy", "baseline_m", "min_depth_m",
                         "max_disparity", "sigma_d_px", "correlation_px", "locking_px", "fattening_px",
                         "spike_fraction", "dropout_fraction", "disparity_step_px"});
  const YamlMap laser = top.map(
      "laser", {"beams", "least_range_m", "most_range_m", "beam_angle_rad", "beam_radius_m", "noise_m",
                "noise_far_m", "noise_grazing_m", "bias_m", "pulse_m", "least_reflectance", "intensity"});
  const YamlMap imu = top.map("imu", {"force_noise_g", "force_offset_g", "rate_noise_dps", "rate_offset_dps",
                                      "field_noise_gauss", "field_offset_gauss"});
  const auto size = [&](const char* key) { return imu.number(key, 0, 1000); };
  return {read_stereo(stereo),
          stereo.number("rate_hz", 1, 30),
          read_laser(laser),
          {size("force_noise_g"), size("force_offset_g"), size("rate_noise_dps"), size("rate_offset_dps"),
           size("field_noise_gauss"), size("field_offset_gauss")}};
}

}  // namespace walkman
