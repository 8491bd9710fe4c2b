#include "emulator/nodes/cia301/transmit_pdo.h"

#include <algorithm>
#include <cstring>

#include "drivers/canopen/pdo_protection.h"

namespace walkman::nodes {

TransmitPdo::TransmitPdo(ObjectDictionary& dictionary, Outbox& outbox, int number, std::uint32_t cob_id,
                         const PdoDefaults& defaults, const Time& now)
    : outbox_(outbox), record_(dictionary, PdoRecord::Direction::kTransmit, number, cob_id, defaults) {
  record_.on_change([this, &now] { restart(now); });
}

void TransmitPdo::start(Time now) noexcept {
  operational_ = true;
  restart(now);
}

void TransmitPdo::stop() noexcept {
  operational_ = false;
  restart(Time{});
}

void TransmitPdo::restart(Time now) noexcept {
  syncs_ = 0;
  started_ = record_.sync_start() == 0;
  sent_ = false;
  requested_ = false;
  event_due_ = Time::max();
  if (running() && record_.event_driven()) request(now);
}

can::Frame TransmitPdo::sample() const noexcept {
  can::Frame frame;
  frame.id = record_.identifier();
  for (const PdoRecord::MappedEntry& object : record_.objects()) {
    std::memcpy(frame.data.data() + frame.length, &object.entry->raw, object.bytes);
    frame.length = static_cast<std::uint8_t>(frame.length + object.bytes);
  }
  if (record_.protects()) canopen::protect(frame, record_.bytes(), count_);
  frame.fd = record_.fd();
  if (frame.fd) frame.length = can::fd_length(frame.length);
  return frame;
}

void TransmitPdo::take_sample() noexcept {
  ++count_;
  last_ = sample();
  record_.report();
}

void TransmitPdo::transmit(Time now) noexcept {
  if (record_.type() != 252) take_sample();
  sent_ = true;
  requested_ = false;
  outbox_.replace(last_);
  allowed_from_ = now + record_.inhibit_time();
  const bool timed = record_.event_driven() && record_.event_time() > Time{};
  event_due_ = timed ? now + record_.event_time() : Time::max();
}

void TransmitPdo::request(Time now) noexcept {
  if (now >= allowed_from_) {
    transmit(now);
  } else {
    requested_ = true;
  }
}

void TransmitPdo::sync(std::uint8_t counter, Time now) noexcept {
  if (!running()) return;
  if (record_.type() == 252) {
    take_sample();
    sent_ = true;
    return;
  }
  if (!record_.synchronous()) return;
  if (record_.type() == 0) {
    if (!sent_ || !(sample() == last_)) transmit(now);
    return;
  }
  started_ = started_ || counter == 0 || counter == record_.sync_start();
  if (started_ && ++syncs_ >= record_.type()) {
    syncs_ = 0;
    transmit(now);
  }
}

void TransmitPdo::close_window() noexcept {
  if (running() && record_.synchronous()) outbox_.drop(record_.identifier());
}

void TransmitPdo::event(const Entry& entry, Time now) noexcept {
  if (running() && record_.event_driven() && record_.maps(entry)) request(now);
}

void TransmitPdo::remote_request(std::uint32_t identifier, Time now) noexcept {
  if (!running() || !record_.remote_allowed() || record_.identifier() != identifier) return;
  if (record_.type() == 252 && !sent_) return;  // no SYNC has come yet
  request(now);
}

void TransmitPdo::advance(Time now) noexcept {
  if (event_due_ <= now || (requested_ && allowed_from_ <= now)) request(now);
}

Time TransmitPdo::next_event() const noexcept {
  // An event timer that expires within the inhibit time waits until that has passed.
  if (requested_) return allowed_from_;
  return event_due_ == Time::max() ? event_due_ : std::max(event_due_, allowed_from_);
}

}  // namespace walkman::nodes
