#include "emulator/nodes/cia301/receive_pdo.h"

#include <algorithm>

namespace walkman::nodes {

ReceivePdo::ReceivePdo(ObjectDictionary& dictionary, int number, std::uint32_t cob_id,
                       const PdoDefaults& defaults)
    : dictionary_(dictionary), record_(dictionary, PdoRecord::Direction::kReceive, number, cob_id, defaults) {
  record_.on_change([this] { restart(); });
}

void ReceivePdo::start() noexcept {
  operational_ = true;
  restart();
}

void ReceivePdo::stop() noexcept {
  operational_ = false;
  restart();
}

void ReceivePdo::restart() noexcept {
  waiting_ = false;
  guard_.restart();
  deadline_ = Time::max();
}

ReceivePdo::Outcome ReceivePdo::receive(const can::Frame& frame, bool late, Time now) noexcept {
  if (frame.length < record_.bytes()) return Outcome::kTooShort;
  if (record_.protects() && guard_.judge(frame, record_.bytes()) != canopen::PdoGuard::Verdict::kNew)
    return Outcome::kRefused;
  if (record_.event_time() > Time{}) deadline_ = now + record_.event_time();
  const std::size_t expected = frame.fd ? can::fd_length(record_.bytes()) : record_.bytes();
  const Outcome outcome = frame.length > expected ? Outcome::kTakenTooLong : Outcome::kTaken;
  if (late && record_.synchronous()) return outcome;
  std::copy_n(frame.data.begin(), record_.bytes(), data_.begin());
  if (record_.synchronous()) {
    waiting_ = true;
  } else {
    apply();
  }
  return outcome;
}

void ReceivePdo::sync() noexcept {
  if (!waiting_) return;
  waiting_ = false;
  apply();
}

void ReceivePdo::apply() noexcept {
  std::size_t offset = 0;
  const auto objects = record_.objects();
  for (const PdoRecord::MappedEntry& object : objects.first(objects.size() - (record_.protects() ? 1 : 0))) {
    // A value that the object refuses is dropped: a PDO has no way to answer.
    if (object.entry != nullptr) {
      static_cast<void>(dictionary_.write(*object.entry, std::span(data_).subspan(offset, object.bytes)));
    }
    offset += object.bytes;
  }
  record_.report();
}

bool ReceivePdo::advance(Time now) noexcept {
  if (deadline_ > now) return false;
  deadline_ = Time::max();
  return true;
}

}  // namespace walkman::nodes
