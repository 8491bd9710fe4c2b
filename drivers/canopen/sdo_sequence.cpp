#include "drivers/canopen/sdo_sequence.h"

#include <stdexcept>

#include <fmt/format.h>

#include "drivers/canopen/little_endian.h"

namespace walkman::canopen {

std::string to_string(ObjectAddress address) { return fmt::format("{:04X}h:{}", address.index, address.sub); }

std::string to_string(SdoAbort code) {
  const auto number = static_cast<std::uint32_t>(code);
  return fmt::format("{} ({:04X} {:04X}h)", describe(code), number >> 16, number & 0xFFFFU);
}

void SdoSequence::restart(SdoClient& client) noexcept {
  client.reset();
  next_ = 0;
  under_way_ = asked_twice_ = false;
}

void SdoSequence::begin(SdoClient& client, Time now) const {
  const SdoStep& step = steps_[next_];
  if (step.kind != SdoStep::Kind::kWrite) {
    client.upload(step.address, now);
    return;
  }
  std::array<std::uint8_t, 4> bytes{};
  put(bytes.data(), step.value);
  client.download(step.address, std::span(bytes).first(step.size), now);
}

void SdoSequence::check(const SdoClient& client) const {
  const SdoStep& step = steps_[next_];
  if (step.kind == SdoStep::Kind::kWrite) return;
  if (client.data().size() != step.size) {
    throw std::runtime_error(fmt::format("{} ({}) has {} bytes, expected {}", to_string(step.address),
                                         step.meaning, client.data().size(), step.size));
  }
  std::array<std::uint8_t, 4> bytes{};
  std::memcpy(bytes.data(), client.data().data(), step.size);
  const auto found = get<std::uint32_t>(bytes.data());
  if (step.kind == SdoStep::Kind::kNonZero && found == 0) {
    throw std::runtime_error(fmt::format("{} ({}) is 0", to_string(step.address), step.meaning));
  }
  if (step.kind == SdoStep::Kind::kExpect && found != step.value) {
    throw std::runtime_error(fmt::format("{} ({}) is {:08X}h = {}, expected {:08X}h = {}",
                                         to_string(step.address), step.meaning, found, found, step.value,
                                         step.value));
  }
  if (step.result != nullptr) *step.result = found;
}

bool SdoSequence::advance(SdoClient& client, Time now) {
  if (next_ == steps_.size()) return true;
  const SdoStep& step = steps_[next_];
  if (under_way_ && client.state() == SdoClient::State::kBusy) return false;
  if (under_way_ && client.state() == SdoClient::State::kFailed) {
    const char* verb = step.kind == SdoStep::Kind::kWrite ? "write" : "read";
    const bool silent = client.abort_code() == SdoAbort::kTimeout && !client.aborted_by_server();
    if (!silent) {
      throw std::runtime_error(fmt::format(
          "SDO {} of {} ({}) aborted by {}: {}", verb, to_string(step.address), step.meaning,
          client.aborted_by_server() ? "the node" : "the master", to_string(client.abort_code())));
    }
    if (asked_twice_) {
      throw std::runtime_error(fmt::format(
          "no answer to the SDO {} of {} ({}) within {} ms, requested twice", verb, to_string(step.address),
          step.meaning, std::chrono::duration_cast<std::chrono::milliseconds>(client.timeout()).count()));
    }
    // The abort message of the first attempt must be sent before the second request replaces it.
    if (client.pending() != nullptr) return false;
    asked_twice_ = true;
    begin(client, now);
    return false;
  }
  if (under_way_) {
    check(client);
    under_way_ = asked_twice_ = false;
    client.reset();
    if (++next_ == steps_.size()) return true;
  }
  under_way_ = true;
  begin(client, now);
  return false;
}

}  // namespace walkman::canopen
