#include "drivers/camera/multisense/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace walkman::multisense {
namespace {

constexpr Time kAnswerLimit = std::chrono::seconds(1);  // as the vendor's client: 1 s, five times
constexpr int kAttempts = 5;
constexpr Time kMtuLimit = std::chrono::milliseconds(100);
constexpr Time kRenderLimit = std::chrono::seconds(30);  // a device that casts a frame answers after it
constexpr Time kStatusInterval = std::chrono::seconds(1);
constexpr std::size_t kKeptFrames = 4;
constexpr std::size_t kFirstMtu = 9000, kSecondMtu = 1500;

Time time_of(const SensorTime& t) {
  return std::chrono::seconds(t.seconds) + std::chrono::microseconds(t.microseconds);
}

}  // namespace

Camera::Camera(DatagramPort& port, std::string name, std::function<Time()> now)
    : port_(port), name_(std::move(name)), now_(std::move(now)) {
  open();
}

Camera::~Camera() { send(encode(StreamControl{source::kEverything, 0})); }

void Camera::fail(const std::string& what) const { throw std::runtime_error(name_ + ": " + what); }

void Camera::send(const std::vector<std::uint8_t>& message) {
  Fragments fragments(message, ++sequence_, kLeastMtu);
  std::vector<std::uint8_t> datagram;
  while (!fragments.done()) {
    fragments.next(datagram);
    port_.send(datagram);
  }
}

void Camera::ask(const std::vector<std::uint8_t>& message, const std::function<bool()>& answered) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    send(message);
    do {
      take_in();
      if (answered()) return;
    } while (port_.wait(kAnswerLimit));
  }
  fail(fmt::format("no answer from a MultiSense to message 0x{:04X} in {} s", id_of(message).value_or(0),
                   kAttempts * std::chrono::duration<double>(kAnswerLimit).count()));
}

template <typename Message>
Message Camera::ask_for(Query query) {
  const auto asked = static_cast<std::uint16_t>(query);
  acks_.erase(asked);
  answers_.erase(Message::kId);
  const auto refused = [&] { return acks_.contains(asked) && acks_[asked] != Ack::kOk; };
  ask(encode(query), [&] { return refused() || answers_.contains(Message::kId); });
  if (refused()) fail(fmt::format("the device refuses message 0x{:04X} with status {}", asked, acks_[asked]));
  const auto message = decode<Message>(answers_[Message::kId]);
  if (!message) fail(fmt::format("message 0x{:04X} ends before its last field", Message::kId));
  return *message;
}

void Camera::open() {
  const auto acknowledged = [this](std::uint16_t id) { return [this, id] { return acks_.contains(id); }; };
  ask(encode(StreamControl{source::kEverything, 0}), acknowledged(StreamControl::kId));
  choose_mtu();
  device_ = ask_for<DeviceInfo>(Query::kDeviceInfo);
  const auto config = ask_for<CameraConfig>(Query::kCameraConfig);
  const auto calibration = ask_for<CameraCalibration>(Query::kCameraCalibration);
  width_ = config.width;
  height_ = config.height;
  const float across = static_cast<float>(width_) / static_cast<float>(device_.imager_width);
  const float down = static_cast<float>(height_) / static_cast<float>(device_.imager_height);
  const auto& left = calibration.left.P;
  optics_ = {left[0] * across, left[5] * down, left[2] * across, left[6] * down,
             -calibration.right.P[3] * across};
  const auto usable = [](float value) { return std::isfinite(value) && value > 0; };
  if (!usable(optics_.fx) || !usable(optics_.fy) || !usable(optics_.focal_baseline) ||
      !std::isfinite(optics_.cx) || !std::isfinite(optics_.cy)) {
    fail(
        fmt::format("its calibration has a focal length of {:g} by {:g} px and fx times the baseline of {:g} "
                    "px·m, expected positive numbers",
                    optics_.fx, optics_.fy, optics_.focal_baseline));
  }
}

void Camera::choose_mtu() {
  for (const std::size_t mtu : {kFirstMtu, kSecondMtu}) {
    answers_.erase(MtuAnswer::kId);
    send(encode(MtuTest{static_cast<std::uint32_t>(mtu)}));
    take_in();
    while (!answers_.contains(MtuAnswer::kId) && port_.wait(kMtuLimit)) take_in();
    if (!answers_.contains(MtuAnswer::kId)) continue;
    acks_.erase(Mtu::kId);
    ask(encode(Mtu{static_cast<std::uint32_t>(mtu)}), [this] { return acks_.contains(Mtu::kId); });
    return;
  }
  fail(fmt::format("no datagram for an MTU of {} bytes comes through", kSecondMtu));
}

void Camera::take_in() {
  while (port_.receive(datagram_)) {
    if (const auto message = assembler_.take(datagram_); !message.empty()) take(message);
  }
}

void Camera::take(std::span<const std::uint8_t> message) {
  const std::uint16_t id = id_of(message).value_or(0);
  switch (id) {
    case Ack::kId:
      if (const auto ack = decode<Ack>(message)) acks_[ack->request] = ack->status;
      return;
    case Status::kId:
      if (const auto status = decode<Status>(message); status && asked_status_) {
        offset_ = *asked_status_ - time_of(status->uptime);
        asked_status_.reset();
      }
      return;
    case ImageMetadata::kId:
      if (const auto metadata = decode<ImageMetadata>(message)) {
        captured_.push_back({metadata->frame, time_of(metadata->captured)});
        if (captured_.size() > kKeptFrames) captured_.erase(captured_.begin());
      }
      return;
    case Disparity::kId:
      has_disparity_ =
          decode(message, disparity_) && disparity_.width == width_ && disparity_.height == height_;
      return;
    case DeviceInfo::kId:
    case CameraConfig::kId:
    case CameraCalibration::kId:
    case MtuAnswer::kId:
      answers_[id].assign(message.begin(), message.end());
      return;
    default:
      return;
  }
}

void Camera::ask_status() {
  asked_status_ = status_at_ = now_();
  send(encode(Query::kStatus));
}

/// Everything that the device sent before its answer has come when that has.
void Camera::synchronise() {
  ask_status();
  take_in();
  while (asked_status_) {
    if (!port_.wait(kRenderLimit)) fail("the device does not tell its status any more");
    take_in();
  }
}

void Camera::stream(bool on) {
  acks_.erase(StreamControl::kId);
  asked_stream_ = now_();
  streaming_ = on;
  send(encode(StreamControl{source::kDisparityLeft, on ? source::kDisparityLeft : 0}));
}

bool Camera::latest(Time not_before, camera::OrganizedCloud& out) {
  const bool waits = waiting_ == Waiting::kBlock;
  if (!streaming_) {
    has_disparity_ = false;
    offset_.reset();  // the clocks may have drifted apart since
    status_at_.reset();
    stream(true);
  }
  if (waits) {
    synchronise();
  } else {
    take_in();
    if (!status_at_ || now_() - *status_at_ > kStatusInterval) ask_status();
    if (!acks_.contains(StreamControl::kId) && now_() - *asked_stream_ > kAnswerLimit) stream(true);
  }
  if (!cloud(not_before, out)) return false;
  stream(false);
  return true;
}

bool Camera::cloud(Time not_before, camera::OrganizedCloud& out) {
  if (!has_disparity_ || !offset_) return false;
  const auto captured = std::find_if(captured_.begin(), captured_.end(),
                                     [this](const Captured& one) { return one.frame == disparity_.frame; });
  if (captured == captured_.end() || captured->at + *offset_ < not_before) return false;
  has_disparity_ = false;
  out.stamp = captured->at + *offset_;
  out.frame = static_cast<std::uint64_t>(disparity_.frame);
  out.width = width_;
  out.height = height_;
  out.points.resize(disparity_.pixels.size());
  const float baseline = optics_.focal_baseline / optics_.fx;
  const float square = optics_.fx / optics_.fy;
  auto point = out.points.begin();
  auto pixel = disparity_.pixels.begin();
  for (int v = 0; v < out.height; ++v) {
    const float y = (static_cast<float>(v) - optics_.cy) * baseline * square;
    for (int u = 0; u < out.width; ++u, ++point, ++pixel) {
      const float per_px = *pixel > 0 ? 1 / (static_cast<float>(*pixel) * Disparity::kStep)
                                      : std::numeric_limits<float>::quiet_NaN();
      *point = {(static_cast<float>(u) - optics_.cx) * baseline * per_px, y * per_px,
                optics_.focal_baseline * per_px};
    }
  }
  return true;
}

}  // namespace walkman::multisense
