#pragma once

#include "drivers/camera/multisense/datagram.h"
#include "emulator/camera/multisense_device.h"

namespace walkman {

/// A client's end of a connection to a camera in the same process, over which only datagrams pass.
class MultiSensePort final : public multisense::DatagramPort {
 public:
  /// `camera` must outlive the port.
  explicit MultiSensePort(MultiSense& camera) : camera_(camera), device_(camera) {}

  void send(std::span<const std::uint8_t> datagram) override {
    device_.publish(camera_.now(), camera_.exposure(), camera_.turns());
    device_.receive(kOnly, datagram, Time{});
  }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    MultiSenseDevice::Address to = kOnly;
    return device_.next(to, datagram);
  }
  [[nodiscard]] bool wait(Time) override { return device_.waiting() > 0; }

 private:
  static constexpr MultiSenseDevice::Address kOnly = 0;
  MultiSense& camera_;
  MultiSenseDevice device_;
};

}  // namespace walkman
