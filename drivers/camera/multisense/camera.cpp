#include "drivers/camera/multisense/camera.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace walkman::multisense {
namespace {

constexpr Time kAnswerLimit = std::chrono::seconds(1);  // like the vendor's client: 1 s, five attempts
constexpr int kAttempts = 5;
constexpr Time kMtuLimit = std::chrono::milliseconds(100);
constexpr Time kQuiet = std::chrono::milliseconds(50);  // within which everything sent before has arrived
// Most messages ahead of an answer: a device that streams to this client alone queues only a few.
constexpr std::uint64_t kMostBefore = 100;
constexpr std::size_t kMostPolled = 512 << 10;        // bytes processed per poll between two cycles
constexpr Time kForgotten = std::chrono::seconds(5);  // an answer not received by then is no longer expected
constexpr Time kStatusInterval = std::chrono::seconds(1);
constexpr Time kLongestAnswer = std::chrono::seconds(2);  // an answer behind many frames takes a part of this
constexpr std::size_t kKeptFrames = 4;
constexpr std::size_t kMostScans = 4096;                  // not yet taken
constexpr double kPerMinute = 2 * std::numbers::pi / 60;  // rad/s
constexpr std::uint32_t kFirstMtu = kMostMtu, kSecondMtu = kLeastMtu;

bool usable_length(float value) { return std::isfinite(value) && value > 0; }

}  // namespace

void triangulate(const Disparity& image, const RectifiedProjection& projection, camera::OrganizedCloud& out) {
  out.width = image.width;
  out.height = image.height;
  out.points.resize(image.pixels.size());
  const auto [fx, fy, cx, cy, focal_baseline] = projection;
  const float baseline = focal_baseline / fx;
  const float square = fx / fy;
  auto point = out.points.begin();
  auto pixel = image.pixels.begin();
  for (int v = 0; v < out.height; ++v) {
    const float y = (static_cast<float>(v) - cy) * baseline * square;
    for (int u = 0; u < out.width; ++u, ++point, ++pixel) {
      const float per_px = *pixel > 0 ? 1 / (static_cast<float>(*pixel) * Disparity::kStep)
                                      : std::numeric_limits<float>::quiet_NaN();
      *point = {(static_cast<float>(u) - cx) * baseline * per_px, y * per_px, focal_baseline * per_px};
    }
  }
}

Camera::Camera(DatagramPort& port, std::string name, std::function<Time()> now)
    : port_(port), name_(std::move(name)), now_(std::move(now)) {
  open();
}

Camera::~Camera() {
  end_sweep();
  try {
    send(encode(StreamControl{source::kEverything, 0}));
  } catch (const std::exception&) {
    // A device that is gone does not stream to anyone either.
  }
}

void Camera::fail(const std::string& what) const { throw camera::Lost(name_ + ": " + what); }

void Camera::send(const std::vector<std::uint8_t>& message) {
  Fragments fragments(message, ++sequence_, kLeastMtu);
  std::vector<std::uint8_t> datagram;
  while (!fragments.done()) {
    fragments.next(datagram);
    port_.send(datagram);
  }
}

bool Camera::came(const std::function<bool()>& answered, Time limit) {
  const std::uint64_t most = taken_ + kMostBefore;
  take_in();
  while (!answered()) {
    if (taken_ > most || !port_.wait(limit)) return false;
    take_in();
  }
  return true;
}

void Camera::ask(const std::vector<std::uint8_t>& message, const std::function<bool()>& answered) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    send(message);
    if (came(answered, kAnswerLimit)) return;
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
  ask(encode(StreamControl{source::kEverything, 0}), [this] { return acks_.contains(StreamControl::kId); });
  choose_mtu();
  device_ = ask_for<DeviceInfo>(Query::kDeviceInfo);
  calibration_ = ask_for<CameraCalibration>(Query::kCameraCalibration);
  check_calibration();
  if (!device_.laser_name.empty()) static_cast<void>(laser_calibration());
}

void Camera::check_calibration() const {
  const auto& left = calibration_.left.P;
  const float shift = -calibration_.right.P[3];
  if (!usable_length(left[0]) || !usable_length(left[5]) || !usable_length(shift) ||
      !std::isfinite(left[2]) || !std::isfinite(left[6]) || device_.imager_width == 0 ||
      device_.imager_height == 0) {
    fail(fmt::format(
        "an imager of {} by {} px, a focal length of {:g} by {:g} px and fx times the baseline of "
        "{:g} px·m, expected positive numbers",
        device_.imager_width, device_.imager_height, left[0], left[5], shift));
  }
}

void Camera::choose_mtu() {
  const auto passes = [this] { return answers_.contains(MtuAnswer::kId); };
  std::uint32_t mtu = kFirstMtu;
  answers_.erase(MtuAnswer::kId);
  send(encode(MtuTest{mtu}));
  if (!came(passes, kMtuLimit)) {
    mtu = kSecondMtu;
    ask(encode(MtuTest{mtu}), passes);
  }
  acks_.erase(Mtu::kId);
  ask(encode(Mtu{mtu}), [this] { return acks_.contains(Mtu::kId); });
}

void Camera::take_in(std::size_t most) {
  for (std::size_t bytes = 0; bytes < most && port_.receive(datagram_); bytes += datagram_.size()) {
    const auto message = assembler_.take(datagram_);
    if (message.empty()) continue;
    ++taken_;
    take(message);
  }
}

void Camera::take(std::span<const std::uint8_t> message) {
  const std::uint16_t id = id_of(message).value_or(0);
  switch (id) {
    case Ack::kId:
      if (const auto ack = decode<Ack>(message)) acks_[ack->request] = ack->status;
      return;
    case Status::kId:
      // Of several requests the oldest: the sensor's clock then appears older than it is, never newer.
      if (const auto status = decode<Status>(message); status && !asked_status_.empty()) {
        offset_ = asked_status_.front() - time_of(status->uptime);
        asked_status_.pop_front();
      }
      return;
    case ImageMetadata::kId:
      if (const auto metadata = decode<ImageMetadata>(message)) {
        captured_.push_back({metadata->frame, time_of(metadata->captured)});
        if (captured_.size() > kKeptFrames) captured_.erase(captured_.begin());
        lost_before_ = assembler_.lost();
      }
      return;
    case Disparity::kId:
      take_disparity(message);
      return;
    case Image::kId:
      // Only requested sources, and only one source each: there are never more images than bits.
      if (auto image = decode<Image>(message);
          image && (image->source & images_wanted_) != 0 && std::has_single_bit(image->source))
        images_[image->source] = std::move(*image);
      return;
    case LidarData::kId:
      if (auto scan = decode<LidarData>(message); scan && scans_.size() < kMostScans)
        scans_.push_back(std::move(*scan));
      return;
    case LidarCalibration::kId:
    case DeviceInfo::kId:
    case CameraCalibration::kId:
    case CameraConfig::kId:
    case MtuAnswer::kId:
      answers_[id].assign(message.begin(), message.end());
      return;
    default:
      return;
  }
}

void Camera::take_disparity(std::span<const std::uint8_t> message) {
  has_disparity_ = decode(message, disparity_);
  // Metadata of which only a part is missing are among the assembler's lost messages.
  if (streaming_ && has_disparity_ && captured(disparity_.frame) == nullptr &&
      assembler_.lost() == lost_before_)
    ++without_metadata_;
  lost_before_ = assembler_.lost();
}

const Camera::Captured* Camera::captured(std::int64_t frame) const {
  const auto found = std::find_if(captured_.begin(), captured_.end(),
                                  [frame](const Captured& one) { return one.frame == frame; });
  return found == captured_.end() ? nullptr : &*found;
}

void Camera::ask_status() {
  const Time now = now_();
  while (!asked_status_.empty() && now - asked_status_.front() > kForgotten) asked_status_.pop_front();
  asked_status_.push_back(now);
  told_at_ = now;
  send(encode(Query::kStatus));
}

bool Camera::poll_status() {
  const Time now = now_();
  if (told_at_ && now - *told_at_ <= (asked_status_.empty() ? kStatusInterval : kLongestAnswer)) return false;
  asked_status_.clear();
  ask_status();
  return true;
}

/// Waits for the answer to a status request: everything that the device sent before it has then arrived.
void Camera::synchronise() {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t before = asked_status_.size();
    ask_status();
    const std::size_t most = attempt == 0 ? 0 : before;
    if (!came([&] { return asked_status_.size() <= most; }, kAttempts * kAnswerLimit)) continue;
    // After a lost request: no answer to the repeated requests may be left over for the next call.
    if (attempt > 0) static_cast<void>(came([&] { return asked_status_.empty(); }, kQuiet));
    asked_status_.clear();
    return;
  }
  fail("the device no longer reports its status");
}

void Camera::stream(bool on) {
  take_in();  // an earlier acknowledgement does not belong to this request
  acks_.erase(StreamControl::kId);
  streaming_ = on;
  const std::uint64_t sources = source::kDisparityLeft | images_wanted_;
  send(encode(StreamControl{sources, on ? sources : 0}));
}

void Camera::request_spin(double rate) {
  const int attempts = spin_request_ && spin_request_->rate == rate ? spin_request_->attempts : 0;
  if (attempts == kAttempts)
    fail(fmt::format("no answer from a MultiSense to message 0x{:04X} in {} s", SetMotor::kId,
                     kAttempts * std::chrono::duration<double>(kAnswerLimit).count()));
  spin_request_ = SpinRequest{rate, now_(), attempts + 1};
  acks_.erase(SetMotor::kId);
  acks_.erase(StreamControl::kId);
  send(encode(SetMotor{static_cast<float>(rate / kPerMinute)}));
  send(encode(StreamControl{source::kLidar, rate != 0 ? source::kLidar : 0}));
}

bool Camera::spins() {
  if (!spin_request_) return true;
  for (const auto& [id, what] : {std::pair(SetMotor::kId, "to turn its laser"),
                                 std::pair(StreamControl::kId, "to stream its laser")}) {
    const auto ack = acks_.find(id);
    if (ack == acks_.end()) {
      if (now_() - spin_request_->sent > kAnswerLimit) request_spin(spin_request_->rate);
      return false;
    }
    if (ack->second != Ack::kOk) fail(fmt::format("the device refuses {} with status {}", what, ack->second));
  }
  if (spin_request_->rate == 0) scans_.clear();
  spin_request_.reset();
  return true;
}

void Camera::spin(double rate) {
  request_spin(rate);
  while (!came([this] { return spins(); }, kAnswerLimit)) request_spin(rate);
}

std::vector<LidarData> Camera::take_scans() {
  if (waiting_ == Waiting::kBlock) {
    synchronise();
  } else {
    take_in(kMostPolled);
    static_cast<void>(poll_status());
  }
  return std::exchange(scans_, {});
}

const LidarCalibration& Camera::laser_calibration() {
  if (!laser_) laser_ = ask_for<LidarCalibration>(Query::kLidarCalibration);
  return *laser_;
}

bool Camera::begin_sweep(double rate) {
  if (device_.laser_name.empty()) return false;
  try {
    sweep_.emplace(laser_calibration());
  } catch (const std::runtime_error& e) {
    fail(e.what());
  }
  sweep_ends_ = false;
  request_spin(rate);
  return true;
}

bool Camera::swept(std::vector<Eigen::Vector3f>& points) {
  if (!sweep_) return false;
  const std::vector<LidarData> scans = take_scans();
  if (!spins()) return false;
  if (!sweep_ends_) {
    for (const LidarData& scan : scans) sweep_->add(scan, [](Time) { return Eigen::Isometry3d::Identity(); });
    if (sweep_->turned() < std::numbers::pi) return false;
    sweep_ends_ = true;
    request_spin(0);
    if (waiting_ == Waiting::kBlock) synchronise();
    if (!spins()) return false;
  }
  points.clear();
  for (const Sweep::Point& point : sweep_->points()) points.push_back(point.p_F);
  sweep_.reset();
  return true;
}

void Camera::end_sweep() noexcept {
  if (!sweep_) return;
  sweep_.reset();
  spin_request_.reset();
  try {
    send(encode(SetMotor{0}));
    send(encode(StreamControl{source::kLidar, 0}));
  } catch (const std::exception&) {
    // A device that is gone cannot be told.
  }
}

const Image* Camera::image(std::uint64_t source) const {
  const auto found = images_.find(source);
  return found != images_.end() && found->second.frame == disparity_.frame ? &found->second : nullptr;
}

bool Camera::latest(Time not_before, camera::OrganizedCloud& out) {
  if (!streaming_) {
    stream(true);
    has_disparity_ = false;
    offset_.reset();  // the clocks may have drifted apart since
    told_at_.reset();
  }
  if (waiting_ == Waiting::kBlock) {
    synchronise();
    if (!acks_.contains(StreamControl::kId)) stream(true);
  } else {
    take_in(kMostPolled);
    const bool again = told_at_.has_value();
    // A device that has heard nothing for a long time stops streaming, and a single request may be lost.
    if (poll_status() && again) stream(true);
  }
  if (!cloud(not_before, out)) return false;
  stream(false);
  return true;
}

/// Projection for the last disparity image; nullopt, and requests what is missing, if it is not known yet.
///
/// The calibration refers to the imager as the device information states it, of which an image has the same
/// part across as down. Where that does not hold (rows are cropped or scaled by themselves), the device's
/// configuration has the projection at the present size.
std::optional<RectifiedProjection> Camera::projection() {
  const auto& left = calibration_.left.P;
  const float shift = -calibration_.right.P[3];
  if (std::uint64_t{disparity_.width} * device_.imager_height ==
      std::uint64_t{disparity_.height} * device_.imager_width) {
    const float across = static_cast<float>(disparity_.width) / static_cast<float>(device_.imager_width);
    const float down = static_cast<float>(disparity_.height) / static_cast<float>(device_.imager_height);
    return RectifiedProjection{left[0] * across, left[5] * down, left[2] * across, left[6] * down,
                               shift * across};
  }
  const auto answered = answers_.find(CameraConfig::kId);
  if (answered != answers_.end()) {
    if (const auto config = decode<CameraConfig>(answered->second)) config_ = *config;
    answers_.erase(answered);
  }
  if (config_.width != disparity_.width || config_.height != disparity_.height) {
    send(encode(Query::kCameraConfig));
    return std::nullopt;
  }
  if (!usable_length(config_.fx) || !usable_length(config_.fy) || !std::isfinite(config_.cx) ||
      !std::isfinite(config_.cy)) {
    fail(fmt::format(
        "a focal length of {:g} by {:g} px and an optical axis at ({:g}, {:g}) px in images of {} by {} px, "
        "expected positive numbers",
        config_.fx, config_.fy, config_.cx, config_.cy, config_.width, config_.height));
  }
  return RectifiedProjection{config_.fx, config_.fy, config_.cx, config_.cy, shift * (config_.fx / left[0])};
}

bool Camera::cloud(Time not_before, camera::OrganizedCloud& out) {
  if (!has_disparity_ || !offset_) return false;
  const Captured* const exposed = captured(disparity_.frame);
  if (exposed == nullptr || exposed->at + *offset_ < not_before) return false;
  const std::optional<RectifiedProjection> at_this_size = projection();
  if (!at_this_size) return false;
  has_disparity_ = false;
  out.stamp = exposed->at + *offset_;
  out.frame = static_cast<std::uint64_t>(disparity_.frame);
  triangulate(disparity_, *at_this_size, out);
  return true;
}

}  // namespace walkman::multisense
