#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/multisense/datagram.h"
#include "drivers/camera/multisense/messages.h"
#include "drivers/camera/multisense/sweep.h"
#include "drivers/camera/range_camera.h"

namespace walkman::multisense {

/// Clouds of a MultiSense's left disparity image.
///
/// Images are streamed only while `latest` is asked for one. The sensor's clock is told by its status
/// messages; a frame is taken to be as old as the round trip of such a message allows.
class Camera final : public camera::RangeCamera {
 public:
  /// Whether `latest` waits for what the device has sent so far, or takes what has come.
  enum class Waiting { kBlock, kPoll };

  /// `port` must outlive the camera. `now` is the caller's clock, on which `latest` and the clouds' stamps
  /// are. Throws camera::Lost with a sentence that begins with `name` when no device answers, or one whose
  /// answers do not go together.
  Camera(DatagramPort& port, std::string name, std::function<Time()> now);
  ~Camera() override;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  void set_waiting(Waiting waiting) { waiting_ = waiting; }
  /// Turns the laser's spindle at `rate` (rad/s) and has its scans streamed until it is told 0. Throws Lost
  /// when the device refuses.
  void spin(double rate);
  /// Scans since the last call, in their order, on the sensor's clock, and their calibration.
  [[nodiscard]] std::vector<LidarData> take_scans();
  [[nodiscard]] LidarCalibration laser_calibration();

  /// Images that are streamed with the disparity, by their bits in `source`.
  void also_stream(std::uint64_t sources) { images_wanted_ = sources; }

  [[nodiscard]] bool latest(Time not_before, camera::OrganizedCloud& out) override;
  [[nodiscard]] bool begin_sweep(double rate) override;
  [[nodiscard]] bool swept(std::vector<Eigen::Vector3f>& points) override;

  /// The disparity image that the last cloud was made of.
  [[nodiscard]] const Disparity& disparity() const { return disparity_; }
  /// The image of a source in that frame; null when it has not come.
  [[nodiscard]] const Image* image(std::uint64_t source) const;

  [[nodiscard]] const DeviceInfo& device() const { return device_; }
  /// Frames of which a part has not come.
  [[nodiscard]] std::uint64_t lost_frames() const { return assembler_.lost(); }

 private:
  struct Captured {
    std::int64_t frame = 0;
    Time at{};  // the sensor's clock
  };

  void open();
  void check_calibration() const;
  [[nodiscard]] bool calibrated();
  /// Sends `message` until `answered`; throws when that never comes.
  void ask(const std::vector<std::uint8_t>& message, const std::function<bool()>& answered);
  template <typename Message>
  [[nodiscard]] Message ask_for(Query query);
  void choose_mtu();
  void send(const std::vector<std::uint8_t>& message);
  void stream(bool on);
  /// Takes in everything that has come, or so many bytes of it and a datagram.
  void take_in(std::size_t most = std::numeric_limits<std::size_t>::max());
  /// Waits for it; false when nothing comes for `limit`, or too much else.
  [[nodiscard]] bool came(const std::function<bool()>& answered, Time limit);
  void take(std::span<const std::uint8_t> message);
  void ask_status();
  void synchronise();
  [[nodiscard]] bool cloud(Time not_before, camera::OrganizedCloud& out);
  [[noreturn]] void fail(const std::string& what) const;

  DatagramPort& port_;
  std::string name_;
  std::function<Time()> now_;
  Waiting waiting_ = Waiting::kBlock;

  std::uint16_t sequence_ = 0;
  Assembler assembler_;
  std::vector<std::uint8_t> datagram_;
  std::map<std::uint16_t, std::vector<std::uint8_t>> answers_;  // the newest of each id that was asked for
  std::map<std::uint16_t, std::int32_t> acks_;

  std::uint64_t taken_ = 0;  // messages

  DeviceInfo device_;
  CameraCalibration calibration_;
  std::deque<Time> asked_status_;  // not answered yet: when, on the caller's clock
  std::optional<Time> told_at_;    // when the last was asked for
  std::optional<Time> offset_;     // of the caller's clock, from the sensor's
  bool streaming_ = false;
  std::vector<Captured> captured_;  // of the last frames
  Disparity disparity_;
  bool has_disparity_ = false;
  std::uint64_t images_wanted_ = 0;
  std::map<std::uint64_t, Image> images_;  // the newest of each source
  std::vector<LidarData> scans_;
  std::optional<Sweep> sweep_;  // begun and not complete
};

}  // namespace walkman::multisense
