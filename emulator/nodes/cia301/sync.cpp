#include "emulator/nodes/cia301/sync.h"

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/communication_table.h"

namespace walkman::nodes {
namespace {

constexpr std::uint32_t kProduce = 0x40000000U;
constexpr std::uint32_t kDoNotCare = 0x80000000U;  // some masters and EDS files set it

}  // namespace

Sync::Sync(ObjectDictionary& dictionary, Outbox& outbox, const Time& now) : outbox_(outbox) {
  cob_id_ = dictionary.object<std::uint32_t>(canopen::object::kSyncCobId);
  cob_id_.on_write([this, &now](std::uint32_t value) -> Refusal {
    const std::uint32_t id = value & kCobIdMask;
    if ((value & ~(kDoNotCare | kProduce | kCobIdMask)) != 0 || restricted_identifier(id))
      return SdoAbort::kValue;
    const bool goes_on = (cob_id_.get() & value & kProduce) != 0;
    if (goes_on && id != identifier_) return SdoAbort::kValue;
    identifier_ = id;
    schedule(now, value, period_.get());
    return std::nullopt;
  });
  period_ = dictionary.object<std::uint32_t>(0x1006);
  period_.on_write([this, &now](std::uint32_t value) -> Refusal {
    if (value != 0 && value < kShortestPeriodUs) return SdoAbort::kTooLow;
    schedule(now, cob_id_.get(), value);
    return std::nullopt;
  });
  window_ = dictionary.object<std::uint32_t>(0x1007);
  overflow_ = dictionary.object<std::uint8_t>(0x1019);
  overflow_.on_write([this](std::uint8_t value) -> Refusal {
    if (period_.get() != 0) return SdoAbort::kDeviceState;
    if (value == 1 || value > 240) return SdoAbort::kValue;
    counter_ = 0;
    return std::nullopt;
  });
  reload();
}

void Sync::reload() noexcept {
  identifier_ = cob_id_.get() & kCobIdMask;
  counter_ = 0;
  due_ = Time::max();
}

void Sync::enable(bool enabled, Time now) noexcept {
  if (enabled == enabled_) return;
  enabled_ = enabled;
  counter_ = 0;
  schedule(now, cob_id_.get(), period_.get());
}

void Sync::schedule(Time from, std::uint32_t cob_id, std::uint32_t period_us) noexcept {
  const bool produces = enabled_ && (cob_id & kProduce) != 0 && period_us != 0;
  due_ = produces ? from + std::chrono::microseconds(period_us) : Time::max();
}

bool Sync::advance(Time now) noexcept {
  if (due_ > now) return false;
  can::Frame frame;
  frame.id = identifier_;
  if (overflow_.get() != 0) {
    counter_ = counter_ >= overflow_.get() ? std::uint8_t{1} : static_cast<std::uint8_t>(counter_ + 1);
    frame.length = 1;
    frame.data[0] = counter_;
  } else {
    counter_ = 0;
  }
  outbox_.replace(frame);
  // From the due time, so that the period does not drift.
  schedule(due_, cob_id_.get(), period_.get());
  if (due_ <= now) schedule(now, cob_id_.get(), period_.get());
  return true;
}

}  // namespace walkman::nodes
