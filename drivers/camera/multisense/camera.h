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

/// Projection of the rectified pair for images of one size.
struct RectifiedProjection {
  float fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
  float fx_baseline = 0;                 ///< fx times the baseline, px·m
};

/// Writes the points of a disparity image and their numbers of columns and rows into `out`, whose stamp and
/// frame stay as they are.
void triangulate(const Disparity& image, const RectifiedProjection& projection, camera::OrganizedCloud& out);

/// Point clouds from a MultiSense's left disparity image.
///
/// Images are streamed only from a call of `latest` until it returns a cloud. The sensor's clock is derived
/// from its status messages; a frame is taken to be as old as the round trip of such a message allows.
class Camera final : public camera::RangeCamera {
 public:
  /// Whether `latest` waits for everything sent by the device so far, or takes only what has arrived.
  enum class Waiting { kBlock, kPoll };

  /// `port` must outlive the camera. `now`: the caller's clock, used by `latest` and the clouds' stamps.
  /// Throws camera::Lost, with a sentence that begins with `name`, if no device answers or its answers are
  /// inconsistent.
  Camera(DatagramPort& port, std::string name, std::function<Time()> now);
  ~Camera() override;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  void set_waiting(Waiting waiting) { waiting_ = waiting; }
  /// Turns the laser's spindle at `rate` (rad/s) and streams its scans until called with 0; waits until the
  /// device does so. Throws Lost if it refuses, or does not answer.
  void spin(double rate);
  /// Scans received since the last call, in order, on the sensor's clock; and their calibration.
  [[nodiscard]] std::vector<LidarData> take_scans();
  [[nodiscard]] const LidarCalibration& laser_calibration();

  /// Selects images to be streamed along with the disparity, by their bits in `source`.
  void also_stream(std::uint64_t sources) { images_wanted_ = sources; }

  [[nodiscard]] bool latest(Time not_before, camera::OrganizedCloud& out) override;
  [[nodiscard]] bool begin_sweep(double rate) override;
  [[nodiscard]] bool swept(std::vector<Eigen::Vector3f>& points) override;
  void end_sweep() noexcept override;

  /// The disparity image from which the last cloud was computed.
  [[nodiscard]] const Disparity& disparity() const { return disparity_; }
  /// The image from `source` in the same frame; null if it has not arrived.
  [[nodiscard]] const Image* image(std::uint64_t source) const;

  [[nodiscard]] const DeviceInfo& device() const { return device_; }
  /// Number of frames of which a part did not arrive; one that lost parts of several messages counts for
  /// each.
  [[nodiscard]] std::uint64_t lost_frames() const { return assembler_.lost() + without_metadata_; }

 private:
  struct Captured {
    std::int64_t frame = 0;
    Time at{};  // on the sensor's clock
  };

  void open();
  void check_calibration() const;
  [[nodiscard]] std::optional<RectifiedProjection> projection();
  /// Sends `message` until `answered` returns true; throws if it never does.
  void ask(const std::vector<std::uint8_t>& message, const std::function<bool()>& answered);
  template <typename Message>
  [[nodiscard]] Message ask_for(Query query);
  void choose_mtu();
  void send(const std::vector<std::uint8_t>& message);
  void stream(bool on);
  /// Processes everything that has arrived, or up to `most` bytes plus one datagram.
  void take_in(std::size_t most = std::numeric_limits<std::size_t>::max());
  /// Waits for `answered`; returns false if nothing arrives for `limit`, or too many other messages do.
  [[nodiscard]] bool came(const std::function<bool()>& answered, Time limit);
  void take(std::span<const std::uint8_t> message);
  void take_disparity(std::span<const std::uint8_t> message);
  [[nodiscard]] const Captured* captured(std::int64_t frame) const;
  void ask_status();
  /// When polling: asks again once the last status is old. One request at a time: whose answer came is then
  /// certain. Returns whether it has asked.
  bool poll_status();
  void synchronise();
  void request_spin(double rate);
  /// Whether the device has done what `request_spin` asked; repeats the request when that is overdue. Throws
  /// Lost.
  [[nodiscard]] bool spins();
  [[nodiscard]] bool cloud(Time not_before, camera::OrganizedCloud& out);
  [[noreturn]] void fail(const std::string& what) const;

  DatagramPort& port_;
  std::string name_;
  std::function<Time()> now_;
  Waiting waiting_ = Waiting::kBlock;

  std::uint16_t sequence_ = 0;
  Assembler assembler_;
  std::vector<std::uint8_t> datagram_;
  std::map<std::uint16_t, std::vector<std::uint8_t>> answers_;  // newest answer of each id requested
  std::map<std::uint16_t, std::int32_t> acks_;

  std::uint64_t taken_ = 0;  // messages processed

  DeviceInfo device_;
  CameraCalibration calibration_;
  CameraConfig config_;            // requested only for an image size that does not follow from the above
  std::deque<Time> asked_status_;  // times of unanswered requests, on the caller's clock
  std::optional<Time> told_at_;    // time of the last status request
  std::optional<Time> offset_;     // caller's clock minus sensor's clock
  bool streaming_ = false;
  std::vector<Captured> captured_;      // of the last few frames
  std::uint64_t without_metadata_ = 0;  // disparity images
  std::uint64_t lost_before_ = 0;       // the assembler's count after the last metadata or disparity image
  Disparity disparity_;
  bool has_disparity_ = false;
  std::uint64_t images_wanted_ = 0;
  std::map<std::uint64_t, Image> images_;  // newest image of each source
  std::vector<LidarData> scans_;
  /// A rate of the spindle that was requested and is not yet acknowledged.
  struct SpinRequest {
    double rate = 0;
    Time sent{};  // on the caller's clock
    int attempts = 0;
  };
  std::optional<SpinRequest> spin_request_;
  std::optional<LidarCalibration> laser_;  // once known
  std::optional<Sweep> sweep_;             // started and not yet complete
  bool sweep_ends_ = false;                // it is complete, and the spindle has yet to stop
};

}  // namespace walkman::multisense
