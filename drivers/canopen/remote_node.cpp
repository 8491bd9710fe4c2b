#include "drivers/canopen/remote_node.h"

#include <stdexcept>

#include <fmt/format.h>

namespace walkman::canopen {
namespace {

// Maximum number of SYNCs to wait for something that is due.
constexpr std::uint64_t kLongestWait = 10;
// Number of times a TPDO may be missing before it is no longer waited for.
constexpr std::uint64_t kMissedTpdos = 3;

double milliseconds(Time time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

RemoteNode::RemoteNode(NodeSettings settings)
    : settings_(std::move(settings)), sdo_(settings_.node_id, kSdoTimeout) {
  for (std::size_t i = 0; i < tpdos_.size(); ++i) {
    const PdoSettings& pdo = settings_.pdos.transmit[i];
    if (!pdo.enabled) continue;
    tpdos_[i].bytes = pdo.bytes();
    tpdos_[i].protects = pdo.protects();
    tpdos_[i].divider = pdo.cyclic() ? pdo.type : 0;
    tpdo_of_function_[pdo.cob_id_base >> 7U & 0xFU] = static_cast<std::uint8_t>(i + 1);
  }
}

std::string RemoteNode::label() const {
  return fmt::format("{} {} (node {} on {})", settings_.noun, settings_.name, settings_.node_id,
                     settings_.interface);
}

void RemoteNode::begin_boot(Time now) noexcept {
  stage_ = Stage::kAwaitingBootUp;
  boot_up_ = false;
  nmt_state_ = NmtState::kBootUp;
  heartbeat_at_ = now;
  reset_sent_ = operational_seen_ = false;
  odd_heartbeats_ = 0;
  heard_at_ = Time::min();
  for (Tpdo& tpdo : tpdos_) {
    tpdo.at = Time::min();
    tpdo.guard.restart();
    tpdo.refused = 0;
  }
  sdo_.reset();
  clear_events();
  on_begin_boot();
}

bool RemoteNode::configure(Time now) {
  if (boot_up_) {
    boot_up_ = false;
    stage_ = Stage::kConfiguring;
    configuration_.restart(sdo_);
    quickest_answer_ = Time::max();
  }
  if (stage_ != Stage::kConfiguring) return stage_ == Stage::kConfigured;
  try {
    if (configuration_.advance(sdo_, now)) stage_ = Stage::kConfigured;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(label() + ": " + error.what());
  }
  if (stage_ == Stage::kConfigured) require_prompt_answers();
  return stage_ == Stage::kConfigured;
}

void RemoteNode::require_prompt_answers() const {
  const Time limit = settings_.cycle * settings_.stale_after_cycles;
  if (limit == Time{0} || quickest_answer_ == Time::max() || quickest_answer_ <= limit) return;
  throw std::runtime_error(
      fmt::format("{}: the quickest of its answers to SDO requests took {:.4g} ms, expected at most {:.4g} "
                  "ms: its frames are late",
                  label(), milliseconds(quickest_answer_), milliseconds(limit)));
}

void RemoteNode::reset_sent() noexcept {
  reset_sent_ = true;
  reset_at_ = syncs_;
}

void RemoteNode::start(Time now) noexcept {
  stage_ = Stage::kStarted;
  heartbeat_at_ = now;
  operational_seen_ = false;
  odd_heartbeats_ = 0;
  for (Tpdo& tpdo : tpdos_) tpdo.guard.restart();
  for (Tpdo& tpdo : tpdos_) tpdo.due = syncs_ + static_cast<std::uint64_t>(tpdo.divider);
}

bool RemoteNode::next_rpdo(int number, can::Frame& out) noexcept {
  if (!rpdo(number, out)) return false;
  const PdoSettings& pdo = settings_.pdos.receive[index_of(number)];
  if (pdo.protects()) protect(out, pdo.bytes(), ++rpdo_counts_[index_of(number)]);
  return true;
}

void RemoteNode::request_sent() noexcept {
  sdo_.sent();
  request_at_ = syncs_;
}

int RemoteNode::sync_divider() const noexcept {
  int divider = 1;
  for (const Tpdo& tpdo : tpdos_) divider = std::max(divider, tpdo.divider);
  return divider;
}

bool RemoteNode::has_cyclic_data() const noexcept { return cyclic_data_at() != Time::min(); }

Time RemoteNode::cyclic_data_at() const noexcept {
  Time oldest = Time::max();
  for (const Tpdo& tpdo : tpdos_) {
    if (tpdo.divider != 0) oldest = std::min(oldest, tpdo.at);
  }
  return oldest == Time::max() ? Time::min() : oldest;
}

Time RemoteNode::newest_cyclic_at() const noexcept {
  Time newest = Time::min();
  for (const Tpdo& tpdo : tpdos_) {
    if (tpdo.divider != 0) newest = std::max(newest, tpdo.at);
  }
  return newest;
}

bool RemoteNode::cycle_complete() const noexcept {
  if (stage_ == Stage::kAwaitingBootUp && reset_sent_ && !boot_up_ && overdue(reset_at_ + 1, kLongestWait)) {
    return false;
  }
  if (sdo_.awaiting() && overdue(request_at_ + 1, kLongestWait)) return false;
  if (stage_ != Stage::kStarted) return true;
  for (const Tpdo& tpdo : tpdos_) {
    if (tpdo.divider != 0 && overdue(tpdo.due, kMissedTpdos * static_cast<std::uint64_t>(tpdo.divider))) {
      return false;
    }
  }
  return true;
}

bool RemoteNode::receive_tpdo(const can::StampedFrame& stamped) noexcept {
  const can::Frame& frame = stamped.frame;
  const int number = tpdo_of_function_[frame.id >> 7U & 0xFU];
  if (number == 0) return false;
  Tpdo& tpdo = tpdos_[index_of(number)];
  if (frame.length != (frame.fd ? can::fd_length(tpdo.bytes) : tpdo.bytes)) return false;
  if (tpdo.protects) {
    const PdoGuard::Verdict verdict = tpdo.guard.judge(frame, tpdo.bytes);
    if (verdict == PdoGuard::Verdict::kCorrupt)  // this was the one due, and no other will replace it
      tpdo.due = syncs_ + static_cast<std::uint64_t>(tpdo.divider);
    if (verdict != PdoGuard::Verdict::kNew) {
      ++tpdo.refused;
      return true;
    }
  }
  tpdo.refused = 0;
  tpdo.at = stamped.time;
  tpdo.due = syncs_ + static_cast<std::uint64_t>(tpdo.divider);
  if (stage_ == Stage::kStarted && !operational_seen_) {
    operational_seen_ = true;
    nmt_state_ = NmtState::kOperational;
    odd_heartbeats_ = 0;
  }
  on_tpdo(number, stamped);
  return true;
}

bool RemoteNode::receive(const can::StampedFrame& stamped, Time now) noexcept {
  if (!take(stamped, now)) return false;
  heard_at_ = std::max(heard_at_, stamped.time);
  ++frames_since_sync_;
  return true;
}

bool RemoteNode::take(const can::StampedFrame& stamped, Time now) noexcept {
  const can::Frame& frame = stamped.frame;
  if (frame.extended || frame.remote || frame.error) return false;
  const std::uint32_t function = frame.id & 0x780U;
  const bool pdo = function >= 0x180 && function < 0x580;
  if (frame.fd && !(pdo && settings_.fd)) return false;
  if (pdo) return receive_tpdo(stamped);
  switch (function) {
    case 0x080: {
      const std::optional<EmcyMessage> emergency = decode_emcy(frame);
      if (!emergency) return false;
      if (emergency->code != 0) {
        ++emergencies_;
        if (!emergency_) emergency_ = emergency;
      }
      return true;
    }
    case 0x580:
      if (frame.length != 8) return false;
      if (sdo_.awaiting()) quickest_answer_ = std::min(quickest_answer_, stamped.time - sdo_.asked_at());
      sdo_.receive(frame, now);
      return true;
    case 0x700:
      return on_error_control(stamped);
    default:
      return false;
  }
}

bool RemoteNode::on_error_control(const can::StampedFrame& stamped) noexcept {
  if (stamped.frame.length != 1) return false;
  const auto state = static_cast<NmtState>(stamped.frame.data[0] & 0x7FU);
  switch (state) {
    case NmtState::kBootUp:
      boot_up_ = true;
      if (stage_ == Stage::kStarted) stage_ = Stage::kLost;
      break;
    case NmtState::kStopped:
    case NmtState::kOperational:
    case NmtState::kPreOperational:
      break;
    default:
      return false;
  }
  nmt_state_ = state;
  odd_heartbeats_ = state == NmtState::kOperational ? 0 : odd_heartbeats_ + 1;
  operational_seen_ = operational_seen_ || state == NmtState::kOperational;
  heartbeat_at_ = std::max(heartbeat_at_, stamped.time);
  return true;
}

void RemoteNode::poll(Time now) noexcept { sdo_.poll(now); }

Time RemoteNode::heartbeat_age(Time now) const noexcept { return std::max(Time{0}, now - heartbeat_at_); }

void RemoteNode::clear_events() noexcept {
  emergency_.reset();
  request_failed_.reset();
}

void RemoteNode::latch_request_failure() noexcept {
  if (!request_failed_) request_failed_ = cause::RequestFailed{sdo_.address(), sdo_.abort_code()};
}

bool RemoteNode::heartbeat_lost(Time now) const noexcept {
  return heartbeat_age(now) > settings_.heartbeat_timeout;
}

std::optional<cause::NoTpdo> RemoteNode::stale(Time now) const noexcept {
  for (std::size_t i = 0; i < tpdos_.size(); ++i) {
    const Time limit = settings_.cycle * settings_.stale_after_cycles * tpdos_[i].divider;
    const Time age = age_of(tpdos_[i].at, now);
    if (limit == Time{0} || age <= limit) continue;
    return cause::NoTpdo{static_cast<int>(i + 1), age, limit, tpdos_[i].refused};
  }
  return std::nullopt;
}

bool RemoteNode::left_operational(Time now) const noexcept {
  if (nmt_state_ == NmtState::kOperational) return false;
  if (odd_heartbeats_ != 1) return true;
  // The next SYNC's TPDOs arrive within a cycle after it, and may be a cycle late.
  return newest_cyclic_at() <= heartbeat_at_ && now - heartbeat_at_ > settings_.cycle * (sync_divider() + 1);
}

std::optional<FaultCause> RemoteNode::judge(Time now) const noexcept {
  if (stage_ == Stage::kLost) return cause::BootUp{};
  if (emergency_) return cause::Emcy{*emergency_, error_text(emergency_->code)};
  if (auto found = judge_state()) return found;
  if (left_operational(now)) return cause::LeftOperational{nmt_state_};
  if (heartbeat_lost(now)) return cause::NoHeartbeat{heartbeat_age(now), settings_.heartbeat_timeout};
  if (request_failed_) return *request_failed_;
  if (const auto found = stale(now)) return *found;
  return judge_values(now);
}

std::string RemoteNode::what_is_missing() const {
  if (stage_ == Stage::kAwaitingBootUp) return "no boot-up message";
  if (stage_ == Stage::kConfiguring) {
    return fmt::format("configuration at step {} of {}", configuration_.done() + 1, configuration_.size());
  }
  if (stage_ != Stage::kStarted) return {};
  for (std::size_t i = 0; i < tpdos_.size(); ++i) {
    if (tpdos_[i].divider != 0 && tpdos_[i].at == Time::min()) return fmt::format("no TPDO{}", i + 1);
  }
  if (std::string missing = what_samples_miss(); !missing.empty()) return missing;
  if (nmt_state_ != NmtState::kOperational) return "no heartbeat with state operational";
  return {};
}

}  // namespace walkman::canopen
