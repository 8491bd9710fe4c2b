#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "emulator/bus/bridge.h"
#include "emulator/emulator.h"

namespace walkman::test {

inline const can::Frame kReadType(0x60B, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});  // 1000h of node 11

/// A network interface made of two queues: what programs have sent, and what they would receive.
class QueueInterface final : public can::Interface {
 public:
  explicit QueueInterface(std::string name) : name_(std::move(name)) {}
  can::SendResult send(const can::Frame& frame) noexcept override {
    if (down) return can::SendResult::kInterfaceDown;
    if (handed.size() >= room) return can::SendResult::kQueueFull;
    handed.push_back(frame);
    return can::SendResult::kQueued;
  }
  void flush() noexcept override { ++flushes; }
  bool receive(can::StampedFrame& out) noexcept override {
    if (sent.empty()) return false;
    out = {Time{}, sent.front()};
    sent.pop_front();
    return true;
  }
  std::uint64_t receive_overflows() const noexcept override { return 0; }
  std::string_view name() const noexcept override { return name_; }

  std::deque<can::Frame> sent;     ///< by programs, for the bus
  std::vector<can::Frame> handed;  ///< by the bus, to programs
  std::size_t room = 1'000'000;
  bool down = false;
  int flushes = 0;

 private:
  std::string name_;
};

/// The robot of Experiment 1 with its two arms connected to queues.
struct SmallWorld {
  explicit SmallWorld(bool bus_timing = true);

  Scene scene;
  RobotModel robot;
  DeviceTable devices;
  std::unique_ptr<Emulator> emulator;
  QueueInterface rarm{"vcan0"}, larm{"vcan1"};
  std::vector<std::unique_ptr<bus::Bridge>> bridges;
  std::vector<std::string> log;  ///< every frame of every bus, in the order of the observers' calls

  [[nodiscard]] std::vector<bus::Bridge*> plugged() const { return {bridges[0].get(), bridges[1].get()}; }
};

/// Returns how many of the frames have this identifier.
[[nodiscard]] std::size_t count(const std::vector<can::Frame>& frames, std::uint32_t id);

}  // namespace walkman::test
