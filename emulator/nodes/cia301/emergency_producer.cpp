#include "emulator/nodes/cia301/emergency_producer.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/communication_table.h"

namespace walkman::nodes {

EmergencyProducer::EmergencyProducer(ObjectDictionary& dictionary, Outbox& outbox) : outbox_(outbox) {
  error_register_ = dictionary.object<std::uint8_t>(canopen::object::kErrorRegister);
  history_count_ = dictionary.object<std::uint8_t>(canopen::object::kErrorField);
  history_count_.on_write([this](std::uint8_t value) -> Refusal {
    if (value != 0) return SdoAbort::kValue;
    for (auto& entry : history_) entry.set(0);
    return std::nullopt;
  });
  for (std::size_t i = 0; i < kHistory; ++i) {
    const auto sub = static_cast<std::uint8_t>(i + 1);
    history_[i] = dictionary.object<std::uint32_t>(canopen::object::kErrorField, sub);
    history_[i].on_read([this, sub]() -> Refusal {
      if (sub > history_count_.get()) return SdoAbort::kNoData;
      return std::nullopt;
    });
  }
  cob_id_ = dictionary.object<std::uint32_t>(0x1014);
  cob_id_.on_write([this](std::uint32_t value) -> Refusal {
    if (const Refusal refused = check_cob_id(value, cob_id_.get(), kCobIdInvalid)) return refused;
    if ((value & kCobIdInvalid) != 0) waiting_count_ = 0;
    return std::nullopt;
  });
  inhibit_ = dictionary.object<std::uint16_t>(0x1015);
}

void EmergencyProducer::raise(std::uint16_t code, std::uint8_t register_bits,
                              std::span<const std::uint8_t> detail, Time now) noexcept {
  if (active(code) || present_count_ == present_.size()) return;
  present_[present_count_++] = {code, static_cast<std::uint8_t>(register_bits | error_register::kGeneric)};
  update_register();
  std::uint32_t additional = 0;
  if (!detail.empty()) additional = detail[0];
  if (detail.size() > 1) additional |= std::uint32_t{detail[1]} << 8U;
  add_to_history(additional << 16U | code);
  send(code, detail, now);
}

void EmergencyProducer::clear(std::uint16_t code, Time now) noexcept {
  const auto end = present_.begin() + present_count_;
  const auto it = std::find_if(present_.begin(), end, [&](const Present& p) { return p.code == code; });
  if (it == end) return;
  if (static_cast<std::size_t>(it - present_.begin()) < outlasting_) --outlasting_;
  std::copy(it + 1, end, it);
  --present_count_;
  update_register();
  if (present_count_ == 0) send(0, {}, now);
}

bool EmergencyProducer::active(std::uint16_t code) const noexcept {
  const auto end = present_.begin() + present_count_;
  return std::any_of(present_.begin(), end, [&](const Present& p) { return p.code == code; });
}

void EmergencyProducer::enable(bool enabled) noexcept {
  enabled_ = enabled;
  if (!enabled) waiting_count_ = 0;
}

void EmergencyProducer::reset() noexcept {
  present_count_ = outlasting_ = 0;
  forget_reports();
}

void EmergencyProducer::reset_communication() noexcept {
  const auto end = present_.begin() + present_count_;
  const auto kept = std::remove_if(
      present_.begin(), end, [](const Present& p) { return (p.bits & error_register::kCommunication) != 0; });
  present_count_ = outlasting_ = static_cast<std::size_t>(kept - present_.begin());
  forget_reports();
}

void EmergencyProducer::announce(Time now) noexcept {
  for (std::size_t i = 0; i < outlasting_; ++i) {
    add_to_history(present_[i].code);
    send(present_[i].code, {}, now);
  }
  outlasting_ = 0;
}

void EmergencyProducer::forget_reports() noexcept {
  waiting_count_ = 0;
  allowed_from_ = Time{};
  history_count_.set(0);
  for (auto& entry : history_) entry.set(0);
  update_register();
}

void EmergencyProducer::advance(Time now) noexcept {
  while (waiting_count_ > 0 && allowed_from_ <= now) {
    can::Frame frame;
    frame.id = cob_id_.get() & kCobIdMask;
    frame.length = 8;
    std::copy(waiting_[0].begin(), waiting_[0].end(), frame.data.begin());
    outbox_.push(frame);
    std::copy(waiting_.begin() + 1, waiting_.begin() + waiting_count_, waiting_.begin());
    --waiting_count_;
    allowed_from_ = now + std::chrono::microseconds(100) * inhibit_.get();
  }
}

Time EmergencyProducer::next_event() const noexcept {
  return waiting_count_ > 0 ? allowed_from_ : Time::max();
}

void EmergencyProducer::add_to_history(std::uint32_t value) noexcept {
  for (std::size_t i = kHistory - 1; i > 0; --i) history_[i].set(history_[i - 1].get());
  history_[0].set(value);
  history_count_.set(static_cast<std::uint8_t>(std::min<std::size_t>(history_count_.get() + 1U, kHistory)));
}

void EmergencyProducer::update_register() noexcept {
  std::uint8_t bits = 0;
  for (std::size_t i = 0; i < present_count_; ++i) bits |= present_[i].bits;
  error_register_.set(bits);
}

void EmergencyProducer::send(std::uint16_t code, std::span<const std::uint8_t> detail, Time now) noexcept {
  if (!enabled_ || (cob_id_.get() & kCobIdInvalid) != 0 || waiting_count_ == waiting_.size()) return;
  Payload& payload = waiting_[waiting_count_++];
  payload.fill(0);
  canopen::put(payload.data(), code);
  payload[2] = error_register_.get();
  std::copy_n(detail.begin(), std::min<std::size_t>(detail.size(), 5), payload.begin() + 3);
  advance(now);
}

}  // namespace walkman::nodes
