#include "drivers/canopen/bus_traffic.h"

#include <algorithm>

namespace walkman::canopen {
namespace {

constexpr int kExtensionBits = 25;  // additional bits of an extended identifier, with stuff bits

}  // namespace

BusTraffic::BusTraffic(const can::BitRates& rates) noexcept
    : extension_(std::chrono::nanoseconds(std::int64_t{1'000'000'000} * kExtensionBits / rates.nominal)) {
  for (std::size_t bytes = 0; bytes < times_.size(); ++bytes)
    times_[bytes] = can::worst_frame_time(bytes, rates);
}

Time BusTraffic::time_of(const can::Frame& frame) const noexcept {
  const std::size_t bytes = frame.remote ? 0 : std::min<std::size_t>(frame.length, can::kMaxPayload);
  return times_[bytes] + (frame.extended ? extension_ : Time{0});
}

void BusTraffic::add_foreign(const can::Frame& frame) noexcept {
  present_.foreign += time_of(frame);
  ++present_.frames;
  if (frame.id == candidate_ && frame.extended == candidate_extended_) {
    ++votes_;
  } else if (votes_ == 0) {
    candidate_ = frame.id;
    candidate_extended_ = frame.extended;
    votes_ = 1;
  } else {
    --votes_;
  }
}

void BusTraffic::end_cycle(Time now) noexcept {
  present_.ended = now;
  cycles_[next_] = present_;
  next_ = (next_ + 1) % kCycles;
  present_ = Cycle{};
  votes_ -= votes_ / kCycles;  // what was frequent long ago must not win forever
}

BusTraffic::Foreign BusTraffic::foreign() const noexcept {
  Foreign foreign;
  foreign.id = candidate_;
  foreign.extended = candidate_extended_;
  // The end of the oldest cycle is the beginning of the others.
  const Cycle& oldest = cycles_[next_];
  const Cycle& newest = cycles_[(next_ + kCycles - 1) % kCycles];
  const double seconds = std::chrono::duration<double>(newest.ended - oldest.ended).count();
  if (oldest.ended == Time{} || seconds <= 0) return foreign;
  Time time{};
  std::uint64_t frames = 0;
  for (const Cycle& cycle : cycles_) {
    if (&cycle == &oldest) continue;
    time += cycle.foreign;
    frames += cycle.frames;
  }
  foreign.load = std::chrono::duration<double>(time).count() / seconds;
  foreign.rate_hz = static_cast<double>(frames) / seconds;
  return foreign;
}

void BusTraffic::forget() noexcept {
  present_ = Cycle{};
  cycles_.fill(Cycle{});
  next_ = 0;
  votes_ = 0;
}

}  // namespace walkman::canopen
