#include <array>

#include "drivers/canopen/cob_id.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/nodes/cia301/communication_errors.h"

namespace walkman::nodes {

using canopen::NmtCommand;
using canopen::NmtState;

void CanopenSlave::handle_nmt(const can::Frame& frame) noexcept {
  if (frame.length != 2 || (frame.data[1] != 0 && frame.data[1] != node_id_)) return;
  switch (static_cast<NmtCommand>(frame.data[0])) {
    case NmtCommand::kStart:
      return enter(NmtState::kOperational);
    case NmtCommand::kStop:
      return enter(NmtState::kStopped);
    case NmtCommand::kEnterPreOperational:
      return enter(NmtState::kPreOperational);
    case NmtCommand::kResetNode:
      return reset(true);
    case NmtCommand::kResetCommunication:
      return reset(false);
  }
}

void CanopenSlave::enter(NmtState state) noexcept {
  if (state == state_) return;
  const bool was_operational = state_ == NmtState::kOperational;
  state_ = state;
  emergency_.enable(state != NmtState::kStopped);
  sync_.enable(state != NmtState::kStopped, now_);
  if (state == NmtState::kOperational) {
    window_ends_ = window_closes_ = Time::max();
    for (auto& rpdo : rpdos_) rpdo->start();
    for (auto& tpdo : tpdos_) tpdo->start(now_);
  } else if (was_operational) {
    for (auto& rpdo : rpdos_) rpdo->stop();
    for (auto& tpdo : tpdos_) tpdo->stop();
  }
  if (state == NmtState::kStopped) {
    sdo_server_.reset();
    on_connection_lost(0);
  }
}

void CanopenSlave::reset(bool application) noexcept {
  for (auto& rpdo : rpdos_) rpdo->stop();
  for (auto& tpdo : tpdos_) tpdo->stop();
  sdo_server_.reset();
  application ? lss_.power_on() : lss_.reset_communication();
  take_node_id(lss_.pending());
  dictionary_.power_on(0x1000, application ? 0xFFFF : 0x1FFF);
  for (auto& rpdo : rpdos_) rpdo->reload();
  for (auto& tpdo : tpdos_) tpdo->reload();
  sync_.enable(false, now_);
  sync_.reload();
  outbox_.clear();
  application ? emergency_.reset() : emergency_.reset_communication();
  heartbeat_producer_.stop();
  heartbeat_consumer_.reset();
  guarding_.reset();
  window_ends_ = window_closes_ = Time::max();
  if (application) {
    on_reset();
  } else {
    on_connection_lost(0);
  }
  if (node_id_ != LssSlave::kUnconfigured) return boot();
  state_ = NmtState::kBootUp;
  emergency_.enable(false);
}

void CanopenSlave::boot() noexcept {
  state_ = NmtState::kPreOperational;
  emergency_.enable(true);
  sync_.enable(true, now_);
  heartbeat_producer_.boot_up(now_);
  const bool starts_itself = (start_up_.get() & 4U) == 0;
  if (starts_itself) enter(NmtState::kOperational);
}

void CanopenSlave::take_node_id(std::uint8_t node_id) noexcept {
  node_id_ = node_id;
  if (node_id == LssSlave::kUnconfigured) return;
  dictionary_.shift_node_id(static_cast<int>(node_id) - cob_id_offset_);
  cob_id_offset_ = node_id;
}

void CanopenSlave::handle_lss(const can::Frame& frame) noexcept {
  if (state_ == NmtState::kBootUp && node_id_ != LssSlave::kUnconfigured) return;  // not powered on yet
  if (lss_.receive(frame, node_id_)) reset(false);
}

void CanopenSlave::handle_heartbeat(const can::Frame& frame) noexcept {
  if (frame.length != 1) return;
  const auto node = static_cast<std::uint8_t>(frame.id - canopen::cob_id::error_control(0));
  heartbeat_consumer_.beat(node, now_);
  if (active(communication_error::kMasterLost)) master_found();
}

void CanopenSlave::master_lost(std::uint8_t node) noexcept {
  const std::array<std::uint8_t, 1> detail{node};
  emergency_.raise(communication_error::kMasterLost, error_register::kCommunication, detail, now_);
  on_connection_lost(communication_error::kMasterLost);
  react_to_communication_error();
}

void CanopenSlave::master_found() noexcept {
  if (!heartbeat_consumer_.any_lost() && !guarding_.lost()) clear(communication_error::kMasterLost);
}

void CanopenSlave::stop_missing_the_unwatched() noexcept {
  if (!active(communication_error::kMasterLost)) return;
  // A node that produces a heartbeat is not guarded.
  if (heartbeat_producer_.in_use()) guarding_.reset();
  master_found();
}

// 1029h:1 (CiA 301, 7.5.2.30): to pre-operational if operational, no change, or stopped.
void CanopenSlave::react_to_communication_error() noexcept {
  if (error_behaviour_.get() == 0 && state_ == NmtState::kOperational) enter(NmtState::kPreOperational);
  if (error_behaviour_.get() == 2) enter(NmtState::kStopped);
}

void CanopenSlave::on_link_state(can::LinkState state, Time now) noexcept {
  now_ = now;
  const can::LinkState before = link_;
  link_ = state;
  if (state == before || state_ == NmtState::kBootUp) return;
  if (state == can::LinkState::kBusOff) {
    outbox_.clear();
    sdo_server_.reset();
    on_connection_lost(0);
    react_to_communication_error();
  }
  if (before == can::LinkState::kBusOff) {
    raise(communication_error::kBusOffOver, error_register::kCommunication);
    clear(communication_error::kErrorPassive);
    clear(communication_error::kBusOffOver);
  }
  if (state == can::LinkState::kPassive) {
    raise(communication_error::kErrorPassive, error_register::kCommunication);
  } else if (state == can::LinkState::kActive || state == can::LinkState::kWarning) {
    clear(communication_error::kErrorPassive);
  }
  schedule();
}

void CanopenSlave::watch_overrun() noexcept {
  if (outbox_.overflows() != overflows_reported_) {
    if (outbox_.full()) return;
    overflows_reported_ = outbox_.overflows();
    raise(communication_error::kOverrun, error_register::kCommunication);
  } else if (outbox_.front() == nullptr) {
    clear(communication_error::kOverrun);
  }
}

}  // namespace walkman::nodes
