#include "emulator/nodes/cia301/node_clock.h"

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/cia301/communication_table.h"

namespace walkman::nodes {
namespace {

constexpr std::uint32_t kConsume = 0x80000000U;
constexpr std::uint32_t kMillisecondsMask = 0x0FFFFFFF;  // 28 bits
constexpr Time kDay = std::chrono::hours(24);

}  // namespace

NodeClock::NodeClock(ObjectDictionary& dictionary, const Time& now) {
  cob_id_ = dictionary.object<std::uint32_t>(0x1012);
  // This device does not produce TIME (bit 30).
  cob_id_.on_write([this](std::uint32_t value) -> Refusal {
    const std::uint32_t id = value & kCobIdMask;
    if ((value & ~(kConsume | kCobIdMask)) != 0 || restricted_identifier(id)) return SdoAbort::kValue;
    const bool goes_on = (cob_id_.get() & value & kConsume) != 0;
    if (goes_on && id != (cob_id_.get() & kCobIdMask)) return SdoAbort::kValue;
    return std::nullopt;
  });
  milliseconds_ = dictionary.object<std::uint32_t>(kNodeClock, 1);
  days_ = dictionary.object<std::uint16_t>(kNodeClock, 2);
  const auto read = [this, &now]() -> Refusal {
    publish(now);
    return std::nullopt;
  };
  milliseconds_.on_read(read);
  days_.on_read(read);
}

bool NodeClock::accepts(const can::Frame& frame) const noexcept {
  return (cob_id_.get() & kConsume) != 0 && frame.id == (cob_id_.get() & kCobIdMask);
}

void NodeClock::receive(const can::Frame& frame, Time now) noexcept {
  if (frame.length != 6) return;
  const Time of_day =
      std::chrono::milliseconds(canopen::get<std::uint32_t>(frame.data.data()) & kMillisecondsMask);
  if (of_day >= kDay) return;
  offset_ = canopen::get<std::uint16_t>(frame.data.data() + 4) * kDay + of_day - now;
}

void NodeClock::publish(Time now) noexcept {
  const Time time = now + offset_;
  const auto in_day = std::chrono::duration_cast<std::chrono::milliseconds>(time % kDay);
  milliseconds_.set(static_cast<std::uint32_t>(in_day.count()));
  days_.set(static_cast<std::uint16_t>(time / kDay));
}

}  // namespace walkman::nodes
