// The bus model alone: the length of a frame, and the transfer of frames between participants that do
// nothing.

#include <deque>
#include <memory>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "emulator/bus/can_bus.h"
#include "emulator/bus/frame_length.h"

namespace {

using namespace walkman;

std::vector<can::Frame> frames(std::size_t length, bool fd) {
  std::mt19937 random(1);
  std::vector<can::Frame> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].id = static_cast<std::uint32_t>(0x181 + i);
    all[i].fd = fd;
    all[i].length = static_cast<std::uint8_t>(length);
    for (std::size_t k = 0; k < length; ++k) all[i].data[k] = static_cast<std::uint8_t>(random());
  }
  return all;
}

void BM_FrameLength(benchmark::State& state) {
  const auto all = frames(static_cast<std::size_t>(state.range(0)), state.range(1) != 0);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(bus::wire_length(all[i++ % all.size()]));
}
BENCHMARK(BM_FrameLength)->Args({8, 0})->Args({24, 1});

/// Sends one frame on request.
class Idler final : public bus::Participant {
 public:
  void offer(const can::Frame& frame) {
    frame_ = frame;
    waiting_ = true;
  }
  void receive(const can::Frame& frame, Time) noexcept override { heard_ += frame.length; }
  void advance(Time) noexcept override {}
  [[nodiscard]] Time next_event() const noexcept override { return Time::max(); }
  [[nodiscard]] const can::Frame* pending() const noexcept override { return waiting_ ? &frame_ : nullptr; }
  void take() noexcept override { waiting_ = false; }
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept override { return 0; }

 private:
  can::Frame frame_;
  bool waiting_ = false;
  std::uint64_t heard_ = 0;
};

/// An arm's cycle without an arm: SYNC and 18 frames of the computer, and two frames from each of nine
/// devices.
void BM_BusCycle(benchmark::State& state) {
  bus::CanBus arm("rarm", "can_rarm");
  std::vector<std::unique_ptr<Idler>> devices;
  for (int i = 0; i < 9; ++i) {
    devices.push_back(std::make_unique<Idler>());
    arm.attach(*devices.back());
  }
  const auto all = frames(8, false);
  can::StampedFrame received;
  for (auto _ : state) {
    for (std::size_t i = 0; i < 19; ++i) benchmark::DoNotOptimize(arm.computer_port().send(all[64 + i]));
    for (const std::size_t round : {0U, 32U}) {
      for (std::size_t i = 0; i < devices.size(); ++i) devices[i]->offer(all[round + i]);
      for (int step = 0; step < 5; ++step) arm.advance(arm.now() + std::chrono::milliseconds(1));
    }
    while (arm.computer_port().receive(received)) benchmark::DoNotOptimize(received);
  }
  state.counters["frames_a_cycle"] =
      static_cast<double>(arm.counters().frames) / static_cast<double>(state.iterations());
  state.SetItemsProcessed(static_cast<std::int64_t>(arm.counters().frames));
}
BENCHMARK(BM_BusCycle)->Unit(benchmark::kMicrosecond);

}  // namespace
