#include "emulator/nodes/cia301/heartbeat.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/objects.h"

namespace walkman::nodes {
namespace {

std::uint8_t node_of(std::uint32_t entry) noexcept { return static_cast<std::uint8_t>(entry >> 16U); }
Time time_of(std::uint32_t entry) noexcept { return std::chrono::milliseconds(entry & 0xFFFFU); }
bool in_use(std::uint32_t entry) noexcept {
  return node_of(entry) >= 1 && node_of(entry) <= 127 && time_of(entry) > Time{};
}

}  // namespace

HeartbeatProducer::HeartbeatProducer(ObjectDictionary& dictionary, Outbox& outbox,
                                     const std::uint8_t& node_id, const Time& now)
    : outbox_(outbox), node_id_(node_id) {
  period_ = dictionary.object<std::uint16_t>(canopen::object::kProducerHeartbeat);
  period_.on_write([this, &now](std::uint16_t period_ms) -> Refusal {
    schedule(now, period_ms);
    return std::nullopt;
  });
}

void HeartbeatProducer::schedule(Time from, std::uint16_t period_ms) noexcept {
  due_ = period_ms == 0 ? Time::max() : from + std::chrono::milliseconds(period_ms);
}

void HeartbeatProducer::send(canopen::NmtState state) noexcept {
  outbox_.push(can::Frame(canopen::cob_id::error_control(node_id_), {static_cast<std::uint8_t>(state)}));
}

void HeartbeatProducer::boot_up(Time now) noexcept {
  send(canopen::NmtState::kBootUp);
  schedule(now, period_.get());
}

void HeartbeatProducer::advance(Time now, canopen::NmtState state) noexcept {
  if (due_ > now) return;
  send(state);
  // From the due time, so that the period does not drift.
  schedule(due_, period_.get());
  if (due_ <= now) schedule(now, period_.get());
}

HeartbeatConsumer::HeartbeatConsumer(ObjectDictionary& dictionary) {
  for (std::size_t i = 0; i < kEntries; ++i) {
    entries_[i] = dictionary.object<std::uint32_t>(canopen::object::kConsumerHeartbeat,
                                                   static_cast<std::uint8_t>(i + 1));
    entries_[i].on_write([this, i](std::uint32_t value) -> Refusal {
      if (const Refusal refused = check(i, value)) return refused;
      watches_[i] = {};
      return std::nullopt;
    });
  }
}

Refusal HeartbeatConsumer::check(std::size_t entry, std::uint32_t value) const noexcept {
  if ((value >> 24U) != 0) return SdoAbort::kValue;
  if (!in_use(value)) return std::nullopt;
  for (std::size_t i = 0; i < kEntries; ++i) {
    const bool same_node =
        i != entry && in_use(entries_[i].get()) && node_of(entries_[i].get()) == node_of(value);
    if (same_node) return SdoAbort::kParameter;
  }
  return std::nullopt;
}

void HeartbeatConsumer::beat(std::uint8_t node, Time now) noexcept {
  for (std::size_t i = 0; i < kEntries; ++i) {
    const std::uint32_t entry = entries_[i].get();
    if (in_use(entry) && node_of(entry) == node) watches_[i] = {now + time_of(entry), false};
  }
}

bool HeartbeatConsumer::any_lost() const noexcept {
  return std::any_of(watches_.begin(), watches_.end(), [](const Watch& w) { return w.lost; });
}

bool HeartbeatConsumer::advance(Time now) noexcept {
  bool lost = false;
  for (std::size_t i = 0; i < kEntries; ++i) {
    if (watches_[i].deadline > now) continue;
    watches_[i] = {Time::max(), true};
    if (!lost) lost_node_ = node_of(entries_[i].get());
    lost = true;
  }
  return lost;
}

Time HeartbeatConsumer::next_event() const noexcept {
  Time next = Time::max();
  for (const Watch& watch : watches_) next = std::min(next, watch.deadline);
  return next;
}

void HeartbeatConsumer::reset() noexcept { watches_.fill({}); }

}  // namespace walkman::nodes
