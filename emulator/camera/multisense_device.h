#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/multisense/datagram.h"
#include "drivers/camera/multisense/messages.h"
#include "emulator/camera/multisense.h"

namespace walkman {

/// The MultiSense's side of its protocol: answers requests and streams frames, to each client those it
/// requested. Has no socket, no thread and no clock.
///
/// A client's requests are answered in order, and after every frame that was exposed before the request was
/// sent. A datagram that is not a request of the protocol is not answered. A request gets an acknowledgement,
/// in a datagram of 28 bytes, and nothing else unless it is a query, which has no body, a complete MTU test
/// or a request for a stream.
///
/// Device information and calibrations that a client sets are stored and returned to later queries. They do
/// not change what the camera sees, and the imager's size stays that of the rows in use.
class MultiSenseDevice {
 public:
  /// Identifies a client to the transport.
  using Address = std::uint64_t;
  static constexpr std::size_t kMostClients = 32;
  /// A client silent for this long gets no more frames; the vendor's clients request the status every second.
  static constexpr Time kSilence = std::chrono::seconds(10);

  /// `address`: the one that it says is its own.
  explicit MultiSenseDevice(MultiSense& camera, const std::string& address = "127.0.0.1");

  /// Casts what is new for the clients that stream it. `now`: the sensor's clock; `exposure`: the newest one;
  /// `turns`: the laser's, the newest last.
  void publish(Time now, const Exposure& exposure, const LaserTurns& turns);
  /// Handles a datagram from a client; `host`: a clock for detecting silent clients.
  void receive(Address from, std::span<const std::uint8_t> datagram, Time host);
  /// Gives the next datagram to send and its recipient, serving clients in turn; returns false if there is
  /// none.
  [[nodiscard]] bool next(Address& to, std::vector<std::uint8_t>& datagram);
  /// Number of clients with a datagram to be sent.
  [[nodiscard]] std::size_t waiting() const;
  /// Stops sending to clients that have been silent for too long, until they send something.
  void stop_silent(Time host);
  /// Removes a client whose port is closed.
  void forget(Address client);

  /// Whether a client wants frames. May be called from another thread.
  [[nodiscard]] bool streams() const noexcept { return streams_; }
  /// Number of frames queued for clients. May be called from another thread.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }

 private:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  enum class Kind { kAnswer, kFrame, kScan, kInertial };
  struct Outgoing {
    Kind kind;
    Bytes message;  // that the fragments belong to
    multisense::Fragments fragments;
  };
  struct Client {
    std::uint64_t sources = 0;
    std::array<Time, 3> since{};  // when it requested images, laser and inertial unit, on the sensor's clock
    std::uint64_t last_frame = 0;
    std::size_t mtu = multisense::kLeastMtu;
    std::uint16_t sequence = 0;
    Time heard{};  // on the host's clock
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
  [[nodiscard]] std::optional<bool> store(std::span<const std::uint8_t> message);
  [[nodiscard]] std::int32_t set_resolution(const multisense::Resolution& wanted);
  [[nodiscard]] double fastest() const;  // in the present mode, frames per second
  void set_rate();
  [[nodiscard]] std::int32_t control(const multisense::CameraControl& wanted);
  void note_streams();
  [[nodiscard]] double rows_above() const;
  [[nodiscard]] multisense::DeviceInfo info() const;
  [[nodiscard]] multisense::CameraConfig config() const;
  [[nodiscard]] multisense::CameraCalibration calibration() const;
  [[nodiscard]] multisense::DeviceModes modes() const;

  MultiSense& camera_;
  MultiSense::Mode imager_;
  int used_rows_ = 0;  // of the imager, in the present mode
  Time now_{};
  multisense::CameraControl control_;
  double wanted_rate_ = 0;  // frames per second, before the mode's limit
  multisense::ExternalCalibration external_;
  multisense::Network network_;
  multisense::LightSettings lighting_;
  multisense::TransmitDelay transmit_delay_;
  // As set by a client, in place of the camera's own.
  std::optional<multisense::DeviceInfo> stored_info_;
  std::optional<multisense::CameraCalibration> stored_calibration_;  // of the whole imager
  std::optional<multisense::LidarCalibration> stored_lidar_calibration_;
  MultiSense::Frame frame_;
  multisense::LidarData scan_;
  multisense::ImuData imu_;
  std::uint64_t last_turn_ = 0;
  double spindle_angle_ = 0;
  std::map<Address, Client> clients_;
  Address served_ = 0;  // the last one
  std::atomic<bool> streams_ = false;
  std::atomic<std::uint64_t> frames_ = 0;
};

}  // namespace walkman
