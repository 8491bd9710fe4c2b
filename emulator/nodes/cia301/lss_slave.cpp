#include "emulator/nodes/cia301/lss_slave.h"

#include "drivers/canopen/little_endian.h"

namespace walkman::nodes {
namespace {

// Command specifiers (CiA 305).
constexpr std::uint8_t kSwitchGlobal = 0x04;
constexpr std::uint8_t kSetNodeId = 0x11;
constexpr std::uint8_t kSetBitTiming = 0x13;
constexpr std::uint8_t kActivateBitTiming = 0x15;
constexpr std::uint8_t kStore = 0x17;
constexpr std::uint8_t kSelect = 0x40;  // to 43h: vendor, product, revision, serial
constexpr std::uint8_t kSelected = 0x44;
constexpr std::uint8_t kIdentify = 0x46;  // to 4Bh: vendor, product, revision low, high, serial low, high
constexpr std::uint8_t kIdentifyUnconfigured = 0x4C;
constexpr std::uint8_t kIdentified = 0x4F;
constexpr std::uint8_t kUnconfiguredHere = 0x50;
constexpr std::uint8_t kFastscan = 0x51;
constexpr std::uint8_t kInquire = 0x5A;  // to 5Dh: vendor, product, revision, serial
constexpr std::uint8_t kInquireNodeId = 0x5E;

constexpr std::uint8_t kOutOfRange = 1;
constexpr std::uint8_t kScanStart = 0x80;

bool node_id_allowed(std::uint8_t id) noexcept {
  return (id >= 1 && id <= 127) || id == LssSlave::kUnconfigured;
}

/// Bit rates of the standard's table 0: 1000, 800, 500, 250, 125, (100 reserved), 50, 20, 10 kbit/s.
bool bit_timing_allowed(std::uint8_t table, std::uint8_t entry) noexcept {
  return table == 0 && entry <= 8 && entry != 5;
}

}  // namespace

void LssSlave::power_on() noexcept {
  pending_ = stored_;
  bit_timing_ = stored_bit_timing_;
  reset_communication();
}

void LssSlave::reset_communication() noexcept {
  configuration_ = false;
  selected_ = identified_ = 0;
  scanned_ = 0;
}

void LssSlave::answer(std::uint8_t command) noexcept { answer(command, 0); }

void LssSlave::answer(std::uint8_t command, std::uint32_t value) noexcept {
  can::Frame frame;
  frame.id = kResponseId;
  frame.length = 8;
  frame.data[0] = command;
  canopen::put(frame.data.data() + 1, value);
  outbox_.push(frame);
}

bool LssSlave::receive(const can::Frame& frame, std::uint8_t active) noexcept {
  if (frame.length != 8) return false;
  const Request request(frame.data.data(), 8);
  const std::uint8_t command = request[0];
  const auto value = canopen::get<std::uint32_t>(request.data() + 1);
  if (command == kSwitchGlobal) return switch_global(request, active);
  if (command >= kSelect && command < kSelect + 4) {
    switch_selective(command - kSelect, value);
  } else if (command >= kIdentify && command < kIdentify + 6) {
    identify_remote(command - kIdentify, value);
  } else if (command == kIdentifyUnconfigured) {
    if (active == kUnconfigured && pending_ == kUnconfigured) answer(kUnconfiguredHere);
  } else if (command == kFastscan) {
    fastscan(request, active);
  } else if (configuration_) {
    command >= kInquire ? inquire(command, active) : configure(request);
  }
  return false;
}

bool LssSlave::switch_global(Request request, std::uint8_t active) noexcept {
  if (request[1] > 1) return false;
  const bool was_configuration = configuration_;
  configuration_ = request[1] == 1;
  return was_configuration && !configuration_ && active == kUnconfigured && pending_ != kUnconfigured;
}

void LssSlave::switch_selective(unsigned part, std::uint32_t value) noexcept {
  if (configuration_) return;
  // The four parts come in order; a wrong one restarts the sequence.
  if (part == 0) selected_ = 0;
  selected_ = selected_ == part && value == address_[part] ? selected_ + 1 : 0;
  if (selected_ < address_.size()) return;
  selected_ = 0;
  configuration_ = true;
  answer(kSelected);
}

void LssSlave::identify_remote(unsigned part, std::uint32_t value) noexcept {
  const bool holds[] = {value == address_[0], value == address_[1], value <= address_[2],
                        value >= address_[2], value <= address_[3], value >= address_[3]};
  if (part == 0) identified_ = 0;
  identified_ = identified_ == part && holds[part] ? identified_ + 1 : 0;
  if (identified_ < std::size(holds)) return;
  identified_ = 0;
  answer(kIdentified);
}

void LssSlave::fastscan(Request request, std::uint8_t active) noexcept {
  if (configuration_ || active != kUnconfigured || pending_ != kUnconfigured) return;
  const std::uint8_t bit = request[5];
  const std::uint8_t part = request[6];
  const std::uint8_t next = request[7];
  if (bit == kScanStart) {
    scanned_ = 0;
    return answer(kIdentified);
  }
  if (bit > 31 || part > 3 || next > 3 || part != scanned_) return;
  const auto value = canopen::get<std::uint32_t>(request.data() + 1);
  const std::uint32_t mask = 0xFFFFFFFFU << bit;
  if (((value ^ address_[part]) & mask) != 0) return;
  scanned_ = next;
  configuration_ = bit == 0 && next < part;
  answer(kIdentified);
}

void LssSlave::configure(Request request) noexcept {
  const std::uint8_t command = request[0];
  bool allowed = true;
  switch (command) {
    case kSetNodeId:
      allowed = node_id_allowed(request[1]);
      if (allowed) pending_ = request[1];
      break;
    case kSetBitTiming:
      allowed = bit_timing_allowed(request[1], request[2]);
      if (allowed) bit_timing_ = request[2];
      break;
    case kStore:
      stored_ = pending_;
      stored_bit_timing_ = bit_timing_;
      break;
    case kActivateBitTiming:  // has no answer
    default:
      return;
  }
  answer(command, allowed ? 0 : kOutOfRange);
}

void LssSlave::inquire(std::uint8_t command, std::uint8_t active) noexcept {
  if (command == kInquireNodeId) return answer(command, active);
  if (command < kInquire + address_.size()) answer(command, address_[command - kInquire]);
}

}  // namespace walkman::nodes
