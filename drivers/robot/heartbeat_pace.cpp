#include "drivers/robot/heartbeat_pace.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"

namespace walkman::robot {
namespace {

constexpr std::uint32_t kNodeMask = 0x7F;
constexpr std::uint8_t kBootUp = 0;

}  // namespace

bool HeartbeatPace::receive(can::StampedFrame& out) noexcept {
  if (!inner_->receive(out)) return false;
  observe(out);
  return true;
}

void HeartbeatPace::observe(const can::StampedFrame& stamped) noexcept {
  const can::Frame& frame = stamped.frame;
  const bool error_control = (frame.id & ~kNodeMask) == canopen::cob_id::error_control(0) &&
                             frame.length == 1 && !frame.extended && !frame.remote && !frame.error;
  if (!error_control || (producer_ != 0 && frame.id != producer_)) return;
  if (frame.data[0] == kBootUp) {  // its producer time is back to the default
    producer_ = 0;
    count_ = 0;
    last_ = Time::min();
    return;
  }
  producer_ = frame.id;
  ++heartbeats_;
  if (last_ != Time::min() && count_ < kIntervals) intervals_[count_++] = stamped.time - last_;
  last_ = stamped.time;
}

std::optional<Time> HeartbeatPace::wrong_interval() const noexcept {
  if (count_ < kIntervals) return std::nullopt;
  std::array<Time, kIntervals> sorted = intervals_;
  std::nth_element(sorted.begin(), sorted.begin() + kIntervals / 2, sorted.end());
  const Time median = sorted[kIntervals / 2];
  if (std::chrono::abs(median - expected_) <= tolerance_) return std::nullopt;
  return median;
}

}  // namespace walkman::robot
