#include "emulator/camera/multisense_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <arpa/inet.h>

#include "emulator/plant/actuators/spindle.h"

namespace walkman {
namespace {

using namespace multisense;

constexpr std::uint16_t kFirmware = 0x0303;  // 3.3, as on sensors of that time
constexpr std::uint32_t kGreyCmv4000 = 3;
constexpr float kLensFocalLength = 0.0065F;  // m
constexpr int kImagerPixels = 2048;          // side length of a CMV4000
constexpr int kCroppedRows = 1088;           // its middle ones, as many as a CMV2000 has
constexpr std::array kDisparities = {64, 128, 256};
constexpr double kSlowest = 1;  // frames per second
// Of a resolution's mode: a CMV2000's rows of a CMV4000, at an offset of the client's choice, from
// firmware 3.5 on.
constexpr std::int32_t kCropped = 2000;
// Maximum frames per second of the whole and the cropped imager, and the factor for half the pixels across
// and down. carnegierobotics.com, "2 Megapixel or 4 Megapixel?"
constexpr double kFastest = 3.75, kFastestCropped = 7.5, kHalfSizeGain = 4;
constexpr std::size_t kMostQueued = 8;    // messages; a client that takes them more slowly loses frames
constexpr std::size_t kMostAnswers = 64;  // answers; a client that takes them more slowly loses requests
constexpr std::uint32_t kMtuTestOverhead = 54;
// The emulated lenses have no distortion and the imagers are coplanar: rectified images equal the originals.
constexpr std::uint64_t kLeftLuma = source::kLumaLeft | source::kLumaRectifiedLeft;
constexpr std::uint64_t kRightLuma = source::kLumaRight | source::kLumaRectifiedRight;
constexpr std::uint64_t kUnrectified = source::kLumaLeft | source::kLumaRight;
constexpr std::uint64_t kLuma = kLeftLuma | kRightLuma;
constexpr std::uint64_t kImages = kLuma | source::kDisparityLeft;
constexpr std::uint64_t kServed = kImages | source::kLidar | source::kImu;
constexpr std::size_t kImageGroup = 0, kLaserGroup = 1, kImuGroup = 2;
constexpr std::array kGroups = {kImages, source::kLidar, source::kImu};
constexpr std::size_t kMostScans = Laser::kKept;          // messages, as above
constexpr double kPerMinute = 2 * std::numbers::pi / 60;  // rad/s
constexpr std::uint8_t kLights = 0x0F;
// Of a device in a room; the vendor's tools only show them.
constexpr float kCpuTemperature = 45, kFpgaTemperature = 55;  // °C
// Bits of the status' health, by the vendor's protocol.
constexpr std::uint32_t kLaserWell = 1U << 1, kMotorWell = 1U << 2, kImuWell = 1U << 4;

bool is_quad(const std::string& text) {
  in_addr address{};
  return text.size() < INET_ADDRSTRLEN && inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool all_finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

bool all_finite(const CameraCalibration& calibration) {
  const auto camera = [](const CameraCalibration::Camera& one) {
    return all_finite(one.M) && all_finite(one.D) && all_finite(one.R) && all_finite(one.P);
  };
  return camera(calibration.left) && camera(calibration.right) && camera(calibration.aux);
}

/// Refers the calibration to `rows` more pixels above the image.
void shift_down(CameraCalibration& calibration, double rows) {
  for (CameraCalibration::Camera* camera : {&calibration.left, &calibration.right})
    for (float* cy : {&camera->M[5], &camera->P[6]}) *cy = static_cast<float>(*cy + rows);
}

}  // namespace

MultiSenseDevice::MultiSenseDevice(MultiSense& camera, const std::string& address)
    : camera_(camera), network_{1, address, address, "255.0.0.0"} {
  const MultiSense::Mode now = camera.mode();
  const int scale = std::max(1, kImagerPixels / now.width);
  imager_ = {now.width * scale, now.height * scale, now.disparities};
  used_rows_ = imager_.height;
  wanted_rate_ = camera.rate_hz();
  control_.frames_per_second = static_cast<float>(wanted_rate_);
}

std::size_t MultiSenseDevice::queued(const Client& client, Kind kind) {
  return static_cast<std::size_t>(std::count_if(client.queue.begin(), client.queue.end(),
                                                [&](const Outgoing& one) { return one.kind == kind; }));
}

void MultiSenseDevice::queue(Client& client, Kind kind, Bytes message) {
  const Fragments fragments(*message, ++client.sequence, client.mtu);
  client.queue.push_back({kind, std::move(message), fragments});
}

template <typename Message>
void MultiSenseDevice::answer(Client& client, const Message& message) {
  queue(client, Kind::kAnswer, std::make_shared<const std::vector<std::uint8_t>>(encode(message)));
}

void MultiSenseDevice::acknowledge(Client& client, std::uint16_t request, std::int32_t status) {
  answer(client, Ack{request, status});
}

struct MultiSenseDevice::Published {
  const Exposure& exposure;
  bool images = false;  // whether any client wants them
  bool cast = false;
  Bytes metadata, disparity;
  std::map<std::uint64_t, Bytes> luma;  // by source
};

void MultiSenseDevice::publish(Time now, const Exposure& exposure, const LaserTurns& turns) {
  now_ = now;
  for (const auto& turn : turns) {
    if (turn->number <= last_turn_) continue;
    last_turn_ = turn->number;
    spindle_angle_ = turn->angles.back();
    publish_turn(*turn);
  }
  publish_imu();
  if (exposure.stamp == Time::min()) return;
  Published frame{exposure, {}, {}, {}, {}, {}};
  std::vector<Client*> due;
  for (auto& [address, client] : clients_) {
    if ((client.sources & kImages) == 0 || exposure.stamp < client.since[kImageGroup] ||
        exposure.frame == client.last_frame)
      continue;
    client.last_frame = exposure.frame;
    if (queued(client, Kind::kFrame) > kMostQueued) continue;
    due.push_back(&client);
    frame.images = frame.images || (client.sources & kLuma) != 0;
  }
  for (Client* client : due) publish_to(*client, frame);
}

void MultiSenseDevice::publish_turn(const LaserTurn& turn) {
  Bytes bytes;
  for (auto& [address, client] : clients_) {
    if ((client.sources & source::kLidar) == 0 || turn.first < client.since[kLaserGroup] ||
        queued(client, Kind::kScan) >= kMostScans)
      continue;
    if (!bytes) {
      camera_.scan(turn, scan_);
      bytes = std::make_shared<const std::vector<std::uint8_t>>(encode(scan_));
    }
    queue(client, Kind::kScan, bytes);
  }
}

void MultiSenseDevice::publish_imu() {
  while (camera_.imu() != nullptr && camera_.imu()->take(now_, imu_)) {
    const Time first = imu_.samples.empty() ? now_ : Time(imu_.samples.front().nanoseconds);
    Bytes bytes;
    for (auto& [address, client] : clients_) {
      if ((client.sources & source::kImu) == 0 || first < client.since[kImuGroup] ||
          queued(client, Kind::kInertial) >= kMostScans)
        continue;
      if (!bytes) bytes = std::make_shared<const std::vector<std::uint8_t>>(encode(imu_));
      queue(client, Kind::kInertial, bytes);
    }
  }
}

/// Sources that this camera has.
std::uint64_t MultiSenseDevice::sources() const {
  std::uint64_t all = kImages;
  if (camera_.laser_calibration() != nullptr) all |= source::kLidar;
  if (camera_.imu() != nullptr) all |= source::kImu;
  return all;
}

void MultiSenseDevice::publish_to(Client& client, Published& frame) {
  const auto bytes_of = [](const auto& message) {
    return std::make_shared<const std::vector<std::uint8_t>>(encode(message));
  };
  if (!std::exchange(frame.cast, true)) {
    camera_.render(frame.exposure, frame.images, frame_);
    for (Image* image : {&frame_.left, &frame_.right}) {
      image->exposure_us = control_.exposure.exposure_us;
      image->gain = control_.exposure.gain;
    }
    frame.metadata = bytes_of(metadata(frame.exposure, frame_, control_));
  }
  queue(client, Kind::kFrame, frame.metadata);
  const auto give_luma = [&](std::uint64_t sources, Image& image) {
    for (std::uint64_t source : {sources & kUnrectified, sources & ~kUnrectified}) {
      if ((client.sources & source) == 0) continue;
      Bytes& bytes = frame.luma[source];
      image.source = source;
      if (!bytes) bytes = bytes_of(image);
      queue(client, Kind::kFrame, bytes);
    }
  };
  give_luma(kLeftLuma, frame_.left);
  give_luma(kRightLuma, frame_.right);
  if ((client.sources & source::kDisparityLeft) != 0) {
    if (!frame.disparity) frame.disparity = bytes_of(frame_.disparity);
    queue(client, Kind::kFrame, frame.disparity);
  }
  ++frames_;
}

ImageMetadata MultiSenseDevice::metadata(const Exposure& exposure, const MultiSense::Frame& frame,
                                         const CameraControl& control) {
  ImageMetadata about;
  about.frame = static_cast<std::int64_t>(exposure.frame);
  about.frames_per_second = control.frames_per_second;
  about.gain = control.exposure.gain;
  about.exposure_us = control.exposure.exposure_us;
  about.captured = sensor_time(exposure.stamp);
  about.spindle_microradians = microradians(exposure.spindle_angle);
  if (frame.left.frame != about.frame) return about;
  // Channel by channel, as for an imager with colour filters: the four pixels of a square.
  for (std::size_t i = 0; i < frame.left.pixels.size(); ++i) {
    const std::size_t column = i % frame.left.width, row = i / frame.left.width;
    const std::size_t channel = row % 2 * 2 + column % 2;
    ++about.histogram[channel * 256 + frame.left.pixels[i]];
  }
  return about;
}

void MultiSenseDevice::receive(Address from, std::span<const std::uint8_t> datagram, Time host) {
  const auto head = read_head(datagram);
  // Requests are single datagrams.
  if (!head || head->offset != 0 || head->message_bytes != datagram.size() - kDatagramHeadBytes) return;
  const auto known = clients_.find(from);
  if (known == clients_.end() && clients_.size() == kMostClients) {
    clients_.erase(std::min_element(clients_.begin(), clients_.end(), [](const auto& a, const auto& b) {
      return std::pair(a.second.sources != 0, a.second.heard) <
             std::pair(b.second.sources != 0, b.second.heard);
    }));
  }
  Client& client = clients_[from];
  client.heard = host;
  if (queued(client, Kind::kAnswer) <= kMostAnswers) handle(client, datagram.subspan(kDatagramHeadBytes));
  note_streams();
}

void MultiSenseDevice::handle(Client& client, std::span<const std::uint8_t> message) {
  const std::uint16_t id = *id_of(message);
  // No query has a body.
  if (message.size() == kMessageHeadBytes && handle_query(client, id)) return;
  if (const auto stream = decode<StreamControl>(message)) {
    const std::uint64_t before = client.sources;
    client.sources = (before & ~stream->modify) | (stream->control & stream->modify);
    for (std::size_t group = 0; group < kGroups.size(); ++group)
      if ((client.sources & ~before & kGroups[group]) != 0) client.since[group] = now_;
    acknowledge(client, id, Ack::kOk);
  } else if (const auto test = decode<MtuTest>(message)) {
    if (test->mtu < kLeastMtu || test->mtu > kMostMtu) return;  // nothing that long gets through
    acknowledge(client, id, Ack::kOk);
    const std::size_t before = std::exchange(client.mtu, kMostMtu);
    MtuAnswer full;
    full.filler.resize(test->mtu - kMtuTestOverhead);
    answer(client, full);
    client.mtu = before;
  } else if (const auto mtu = decode<Mtu>(message)) {
    const bool fits = mtu->bytes >= kLeastMtu && mtu->bytes <= kMostMtu;
    if (fits) client.mtu = mtu->bytes;
    acknowledge(client, id, fits ? Ack::kOk : Ack::kUnsupported);
  } else if (const auto resolution = decode<Resolution>(message)) {
    acknowledge(client, id, set_resolution(*resolution));
  } else if (const auto wanted = decode<CameraControl>(message)) {
    acknowledge(client, id, control(*wanted));
  } else if (!handle_setting(client, message) && id != Ack::kId) {
    // An acknowledgement is not acknowledged: two devices that were told of each other would never stop.
    acknowledge(client, id, Ack::kUnknown);
  }
}

/// Handles the spindle's rate, and settings that this camera only stores and returns.
bool MultiSenseDevice::handle_setting(Client& client, std::span<const std::uint8_t> message) {
  const auto keep = [&](bool good) {
    acknowledge(client, *id_of(message), good ? Ack::kOk : Ack::kUnsupported);
    return true;
  };
  if (const auto trigger = decode<Trigger>(message)) return keep(trigger->source == Trigger::kInternal);
  if (const auto motor = decode<SetMotor>(message)) {
    const double rate = motor->rpm * kPerMinute;
    const bool good = camera_.laser_calibration() != nullptr && std::abs(rate) <= plant::Spindle::kMostRate;
    if (good) camera_.turn_spindle(rate);
    return keep(good);
  }
  if (const auto imu = decode<ImuConfig>(message))
    return keep(camera_.imu() != nullptr && camera_.imu()->set(*imu));
  if (const auto stored = store(message)) return keep(*stored);
  if (const auto lights = decode<SetLights>(message)) {
    const auto before = lighting_.intensity;
    lighting_ = lights->settings;
    for (std::size_t i = 0; i < before.size(); ++i)
      if ((lights->changed >> i & 1U) == 0) lighting_.intensity[i] = before[i];
    return keep(true);
  }
  return false;
}

/// Stores what later queries return; returns whether it was acceptable, nullopt if it is another message.
std::optional<bool> MultiSenseDevice::store(std::span<const std::uint8_t> message) {
  if (const auto external = decode<ExternalCalibration>(message)) {
    external_ = *external;
    return true;
  }
  if (const auto network = decode<Network>(message)) {
    if (!is_quad(network->address) || !is_quad(network->gateway) || !is_quad(network->netmask)) return false;
    network_ = *network;
    return true;
  }
  if (const auto delay = decode<TransmitDelay>(message)) {
    if (delay->milliseconds < 0) return false;
    transmit_delay_ = *delay;
    return true;
  }
  if (auto wanted = decode<DeviceInfo>(message)) {
    const DeviceInfo now = info();
    if (wanted->imager_width != now.imager_width || wanted->imager_height != now.imager_height) return false;
    wanted->key.clear();
    stored_info_ = std::move(*wanted);
    return true;
  }
  if (const auto calibration = decode<CameraCalibration>(message)) {
    if (!all_finite(*calibration)) return false;
    stored_calibration_ = *calibration;
    shift_down(*stored_calibration_, rows_above());
    return true;
  }
  if (const auto calibration = decode<LidarCalibration>(message)) {
    if (camera_.laser_calibration() == nullptr || !all_finite(calibration->X_SpL) ||
        !all_finite(calibration->X_CSp))
      return false;
    stored_lidar_calibration_ = *calibration;
    return true;
  }
  return std::nullopt;
}

bool MultiSenseDevice::handle_query(Client& client, std::uint16_t id) {
  const auto give = [&](const auto& message) {
    acknowledge(client, id, Ack::kOk);
    answer(client, message);
    return true;
  };
  switch (static_cast<Query>(id)) {
    case Query::kVersion:
      return give(Version{"walkman-hil", kFirmware, 1, 0, 0});
    case Query::kStatus: {
      Status status;
      status.uptime = sensor_time(now_);
      status.health = Status::kAllWell;
      if (camera_.laser_calibration() == nullptr) status.health &= ~(kLaserWell | kMotorWell);
      if (camera_.imu() == nullptr) status.health &= ~kImuWell;
      status.cpu_temperature_c = kCpuTemperature;
      status.fpga_temperature_c = kFpgaTemperature;
      return give(status);
    }
    case Query::kCameraConfig:
      return give(config());
    case Query::kDeviceInfo:
      return give(info());
    case Query::kCameraCalibration:
      return give(calibration());
    case Query::kMtu:
      return give(Mtu{static_cast<std::uint32_t>(client.mtu)});
    case Query::kDeviceModes:
      return give(modes());
    case Query::kLidarCalibration:
      if (camera_.laser_calibration() == nullptr) return false;
      return give(stored_lidar_calibration_.value_or(*camera_.laser_calibration()));
    case Query::kImuInfo:
      if (camera_.imu() == nullptr) return false;
      return give(HeadImu::info());
    case Query::kImuConfig:
      if (camera_.imu() == nullptr) return false;
      return give(camera_.imu()->config());
    case Query::kMotorPosition:
      if (camera_.laser_calibration() == nullptr) return false;
      return give(MotorPosition{microradians(spindle_angle_)});
    case Query::kNetwork:
      return give(network_);
    case Query::kExternalCalibration:
      return give(external_);
    case Query::kTransmitDelay:
      return give(transmit_delay_);
    case Query::kLighting:
      return give(Lights{kLights, lighting_});
  }
  return false;
}

std::int32_t MultiSenseDevice::set_resolution(const Resolution& wanted) {
  const DeviceModes all = modes();
  // A request of the first version says nothing of disparities, and a client may send -1.
  const int disparities = wanted.disparities > 0 ? wanted.disparities : camera_.mode().disparities;
  const bool offered = std::any_of(all.modes.begin(), all.modes.end(), [&](const DeviceModes::Mode& mode) {
    return mode.width == wanted.width && mode.height == wanted.height &&
           static_cast<std::int32_t>(mode.disparities) == disparities;
  });
  if (!offered || wanted.mode == kCropped) return Ack::kUnsupported;
  const auto width = static_cast<int>(wanted.width), height = static_cast<int>(wanted.height);
  camera_.set_mode({width, height, disparities});
  used_rows_ = height * imager_.width / width;
  set_rate();
  return Ack::kOk;
}

/// Sets the rate asked for, as near as the mode allows: the vendor's tools ask for 30 frames per second in
/// every mode, and for what another mode allowed.
void MultiSenseDevice::set_rate() {
  const double rate = std::clamp(wanted_rate_, kSlowest, fastest());
  control_.frames_per_second = static_cast<float>(rate);
  camera_.set_rate(rate);
}

double MultiSenseDevice::fastest() const {
  const double whole = used_rows_ < imager_.height ? kFastestCropped : kFastest;
  return camera_.mode().width < imager_.width ? whole * kHalfSizeGain : whole;
}

std::int32_t MultiSenseDevice::control(const CameraControl& wanted) {
  // This camera has no other imagers to expose.
  const float asked = wanted.frames_per_second;
  if (!std::isfinite(asked) || asked <= 0 || wanted.exposure.secondary_count > 0) return Ack::kUnsupported;
  control_ = wanted;
  wanted_rate_ = asked;
  set_rate();
  return Ack::kOk;
}

/// Rows of the imager above those that are used.
double MultiSenseDevice::rows_above() const { return (imager_.height - used_rows_) / 2.0; }

DeviceInfo MultiSenseDevice::info() const {
  DeviceInfo info;
  if (stored_info_) {
    info = *stored_info_;
    info.imager_height = static_cast<std::uint32_t>(used_rows_);
    return info;
  }
  info.name = "MultiSense-SL, emulated";
  info.build_date = "emulated";
  info.serial_number = "walkman-hil";
  info.imager_name = "CMV4000";
  info.imager_type = kGreyCmv4000;
  info.imager_width = static_cast<std::uint32_t>(imager_.width);
  info.imager_height = static_cast<std::uint32_t>(used_rows_);
  info.lens_name = "6.5 mm";
  info.lens_type = 1;
  info.baseline = static_cast<float>(camera_.optics().baseline);
  info.focal_length = kLensFocalLength;
  info.lighting_type = 1;
  info.lights = 4;
  if (camera_.laser_calibration() == nullptr) return info;
  info.laser_name = "UTM-30LX-EW";
  info.laser_type = 1;
  info.motor_name = "spindle";
  info.motor_type = 1;
  info.gear_reduction = 50;
  return info;
}

CameraConfig MultiSenseDevice::config() const {
  const sensors::StereoOptions& optics = camera_.optics();
  CameraConfig config;
  config.width = static_cast<std::uint16_t>(optics.width);
  config.height = static_cast<std::uint16_t>(optics.height);
  config.frames_per_second = control_.frames_per_second;
  config.exposure = control_.exposure;
  config.fx = config.fy = static_cast<float>(optics.focal_px);
  config.cx = static_cast<float>(optics.cx);
  config.cy = static_cast<float>(optics.cy);
  config.translation[0] = -static_cast<float>(optics.baseline);
  config.disparities = optics.max_disparity;
  return config;
}

CameraCalibration MultiSenseDevice::calibration() const {
  if (stored_calibration_) {
    CameraCalibration stored = *stored_calibration_;
    shift_down(stored, -rows_above());
    return stored;
  }
  const sensors::StereoOptions& optics = camera_.optics();
  const double scale = static_cast<double>(imager_.width) / optics.width;
  const auto f = static_cast<float>(optics.focal_px * scale);
  const auto cx = static_cast<float>(optics.cx * scale), cy = static_cast<float>(optics.cy * scale);
  const auto shift = static_cast<float>(-optics.focal_px * scale * optics.baseline);
  CameraCalibration out;
  for (CameraCalibration::Camera* camera : {&out.left, &out.right}) {
    camera->M = {f, 0, cx, 0, f, cy, 0, 0, 1};
    camera->R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    camera->P = {f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0};
  }
  out.right.P[3] = shift;
  return out;
}

DeviceModes MultiSenseDevice::modes() const {
  DeviceModes out;
  const auto add = [&](int divisor, int rows) {
    for (const int disparities : kDisparities) {
      out.modes.push_back({static_cast<std::uint32_t>(imager_.width / divisor),
                           static_cast<std::uint32_t>(rows / divisor), static_cast<std::uint32_t>(sources()),
                           static_cast<std::uint32_t>(disparities), 0});
    }
  };
  for (const int divisor : {2, 1}) {
    add(divisor, imager_.height);
    if (imager_.height > kCroppedRows) add(divisor, kCroppedRows);
  }
  return out;
}

std::size_t MultiSenseDevice::waiting() const {
  return static_cast<std::size_t>(std::count_if(clients_.begin(), clients_.end(),
                                                [](const auto& one) { return !one.second.queue.empty(); }));
}

bool MultiSenseDevice::next(Address& to, std::vector<std::uint8_t>& datagram) {
  auto turn = clients_.upper_bound(served_);
  for (std::size_t i = 0; i < clients_.size(); ++i, ++turn) {
    if (turn == clients_.end()) turn = clients_.begin();
    Client& client = turn->second;
    if (client.queue.empty()) continue;
    Outgoing& first = client.queue.front();
    served_ = to = turn->first;
    first.fragments.next(datagram);
    if (first.fragments.done()) client.queue.pop_front();
    return true;
  }
  return false;
}

void MultiSenseDevice::stop_silent(Time host) {
  for (auto& [address, client] : clients_) {
    if (host - client.heard <= kSilence) continue;
    client.sources = 0;
    client.queue.clear();
  }
  note_streams();
}

void MultiSenseDevice::forget(Address client) {
  clients_.erase(client);
  note_streams();
}

void MultiSenseDevice::note_streams() {
  streams_ = std::any_of(clients_.begin(), clients_.end(),
                         [](const auto& one) { return (one.second.sources & kServed) != 0; });
}

}  // namespace walkman
