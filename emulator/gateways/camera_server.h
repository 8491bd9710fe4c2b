#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "emulator/camera/multisense.h"
#include "emulator/camera/multisense_device.h"
#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/paced_outbox.h"

namespace walkman::gateways {

/// Serves the MultiSense's UDP protocol (drivers/camera/multisense/).
///
/// Runs in its own thread, because casting a frame takes longer than a control cycle: the emulator's loop
/// only publishes what the camera saw, and when. A request is answered after all frames that were published
/// before it came, so that what a client has received by then depends on the emulated time alone.
class CameraServer {
 public:
  /// Binds `address`, an IPv4 address with or without a port, at once. `camera` must outlive the server; only
  /// the server may use it for rendering. Throws std::runtime_error with the address.
  CameraServer(const std::string& address, MultiSense& camera);
  ~CameraServer();
  CameraServer(const CameraServer&) = delete;
  CameraServer& operator=(const CameraServer&) = delete;

  /// Publishes the camera's time, `now`, and the newest exposure that the camera has noted. Cheap unless that
  /// is a new one.
  void publish(Time now);

  /// Number of frames sent to clients.
  [[nodiscard]] std::uint64_t served() const noexcept { return device_.frames(); }

 private:
  struct Published {
    Time now{};
    Exposure exposure;
    LaserTurns turns;  // not yet taken over
  };

  void work();
  void wake();
  /// Takes over what the emulator's loop has published.
  void update();
  void take_requests(Time wall);
  void forget_closed();
  /// Hands over what there is to send, as far as the outbox has room.
  void hand_over();

  MultiSenseDevice device_;
  MultiSense& camera_;
  Descriptor socket_, wake_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::uint64_t last_turn_ = 0;
  Time woken_{};         // last wake-up of the thread, on the emulated clock
  Published published_;  // by the emulator's loop
  Published seen_;       // by the thread
  std::optional<PacedOutbox> outbox_;
  std::vector<std::uint8_t> datagram_, request_;
  std::thread thread_;
};

}  // namespace walkman::gateways
