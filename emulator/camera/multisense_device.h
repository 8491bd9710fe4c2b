#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "drivers/camera/multisense/datagram.h"
#include "drivers/camera/multisense/messages.h"
#include "emulator/camera/multisense.h"

namespace walkman {

/// The MultiSense's side of its protocol: answers requests and streams frames, to each client what it asked
/// for. Holds no socket, no thread and no clock.
///
/// What a client sent is answered in order, and behind every frame that was exposed before it was sent. A
/// datagram that is no request of the protocol is not answered.
class MultiSenseDevice {
 public:
  /// What the carrier calls a client by.
  using Address = std::uint64_t;
  static constexpr std::size_t kMostClients = 32;
  /// A client that says nothing for so long gets no more frames: the vendor's ask for the status each second.
  static constexpr Time kSilence = std::chrono::seconds(10);

  explicit MultiSenseDevice(MultiSense& camera);

  /// The sensor's clock is at `now`, `exposure` the newest, `turns` the laser's, the newest last: casts what
  /// is new for those that stream it.
  void publish(Time now, const Exposure& exposure, const LaserTurns& turns);
  /// A datagram from a client; `host` is a clock to tell by who is silent.
  void receive(Address from, std::span<const std::uint8_t> datagram, Time host);
  /// The next datagram to send and to whom, in turns; false when there is none.
  [[nodiscard]] bool next(Address& to, std::vector<std::uint8_t>& datagram);
  /// Clients for whom there is one.
  [[nodiscard]] std::size_t waiting() const;
  /// Sends nothing more to whom was silent for too long, until it speaks.
  void stop_silent(Time host);
  /// A client whose port is closed.
  void forget(Address client);

  /// Whether a client wants frames. May be asked from another thread.
  [[nodiscard]] bool streams() const noexcept { return streams_; }
  /// Frames that were queued for a client. Likewise.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }

 private:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  enum class Kind { kAnswer, kFrame, kScan, kInertial };
  struct Outgoing {
    Kind kind;
    Bytes message;  // which the fragments are of
    multisense::Fragments fragments;
  };
  struct Client {
    std::uint64_t sources = 0;
    std::array<Time, 3> since{};  // when it asked for images, laser and inertial unit, on the sensor's clock
    std::uint64_t last_frame = 0;
    std::size_t mtu = multisense::kLeastMtu;
    std::uint16_t sequence = 0;
    Time heard{};  // host's clock
    std::deque<Outgoing> queue;
  };

  /// A frame's messages, each encoded when the first client wants it.
  struct Published;
  void publish_to(Client& client, Published& frame);
  void publish_turn(const LaserTurn& turn);
  void publish_imu();
  [[nodiscard]] std::uint64_t sources() const;
  [[nodiscard]] static multisense::ImageMetadata metadata(const Exposure& exposure,
                                                          const MultiSense::Frame& frame,
                                                          const multisense::CameraControl& control);
  [[nodiscard]] static std::size_t queued(const Client& client, Kind kind);
  void queue(Client& client, Kind kind, Bytes message);
  template <typename Message>
  void answer(Client& client, const Message& message);
  void acknowledge(Client& client, std::uint16_t request, std::int32_t status);
  void handle(Client& client, std::span<const std::uint8_t> message);
  [[nodiscard]] bool handle_query(Client& client, std::uint16_t id);
  [[nodiscard]] bool handle_setting(Client& client, std::span<const std::uint8_t> message);
  [[nodiscard]] std::int32_t set_resolution(const multisense::Resolution& wanted);
  [[nodiscard]] double fastest() const;  // in the present mode, frames per second
  [[nodiscard]] std::int32_t control(const multisense::CameraControl& wanted);
  void note_streams();
  [[nodiscard]] multisense::DeviceInfo info() const;
  [[nodiscard]] multisense::CameraConfig config() const;
  [[nodiscard]] multisense::CameraCalibration calibration() const;
  [[nodiscard]] multisense::DeviceModes modes() const;

  MultiSense& camera_;
  MultiSense::Mode imager_;
  int used_rows_ = 0;  // of the imager's, in the present mode
  Time now_{};
  multisense::CameraControl control_;
  multisense::ExternalCalibration external_;
  multisense::LightSettings lighting_;
  MultiSense::Frame frame_;
  multisense::LidarData scan_;
  multisense::ImuData imu_;
  std::uint64_t last_turn_ = 0;
  double spindle_angle_ = 0;
  std::map<Address, Client> clients_;
  Address served_ = 0;  // last
  std::atomic<bool> streams_ = false;
  std::atomic<std::uint64_t> frames_ = 0;
};

}  // namespace walkman
