#include "emulator/nodes/cia301/canopen_slave.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/communication_table.h"
#include "emulator/nodes/cia301/emergency_producer.h"

namespace walkman::nodes {

using canopen::NmtState;
namespace object = canopen::object;

namespace {

// CiA has assigned no number to this project; masters regard 0 as a device without an identity.
constexpr std::uint32_t kVendor = 0x4B4C4157;
constexpr std::uint32_t kRevision = 0x00010000;

// 1F80h (CiA 302-2): bit 2 keeps the device from entering operational by itself after boot-up.
constexpr std::uint32_t kWaitForMaster = 4;

DeviceIdentity checked(DeviceIdentity identity) {
  if (identity.node_id < 1 || identity.node_id > 127) {
    throw std::runtime_error("device " + identity.name + ": node-ID " + std::to_string(identity.node_id) +
                             ", expected 1 to 127");
  }
  return identity;
}

ObjectDictionary communication_dictionary(std::uint8_t node_id) {
  ObjectDictionary dictionary(node_id);
  dictionary.add(communication_table());
  return dictionary;
}

}  // namespace

CanopenSlave::CanopenSlave(DeviceIdentity identity)
    : identity_(checked(std::move(identity))),
      node_id_(identity_.node_id),
      cob_id_offset_(identity_.node_id),
      dictionary_(communication_dictionary(node_id_)),
      sync_(dictionary_, outbox_, now_),
      clock_(dictionary_, now_),
      emergency_(dictionary_, outbox_),
      heartbeat_producer_(dictionary_, outbox_, node_id_, now_),
      heartbeat_consumer_(dictionary_),
      guarding_(dictionary_, outbox_, node_id_, now_),
      sdo_server_(dictionary_, outbox_, node_id_),
      parameter_store_(dictionary_),
      lss_(outbox_, {kVendor, identity_.product_code, kRevision, identity_.serial}, node_id_) {
  add_communication_objects();
}

void CanopenSlave::add_communication_objects() {
  const auto own = [this](std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    dictionary_.object<std::uint32_t>(index, sub).factory(value);
  };
  own(object::kDeviceType, 0, identity_.device_type);
  own(object::kIdentity, 1, kVendor);
  own(object::kIdentity, 2, identity_.product_code);
  own(object::kIdentity, 3, kRevision);
  own(object::kIdentity, 4, identity_.serial);
  dictionary_.set_text(0x1008, identity_.name);
  dictionary_.set_text(0x1009, "emulated");
  dictionary_.set_text(0x100A, "1.0");
  error_behaviour_ = dictionary_.object<std::uint8_t>(object::kErrorBehaviour, 1);
  start_up_ = dictionary_.object<std::uint32_t>(0x1F80);
  start_up_.on_write([](std::uint32_t value) -> Refusal {
    if (value != 0 && value != kWaitForMaster) return SdoAbort::kValue;
    return std::nullopt;
  });
}

void CanopenSlave::configure_pdos(const PdoSet& receive, const PdoSet& transmit) {
  for (std::size_t i = 0; i < 4; ++i) {
    const int number = static_cast<int>(i) + 1;
    rpdos_[i] = std::make_unique<ReceivePdo>(dictionary_, number, canopen::cob_id::rpdo(number, node_id_),
                                             receive[i]);
    tpdos_[i] = std::make_unique<TransmitPdo>(dictionary_, outbox_, number,
                                              canopen::cob_id::tpdo(number, node_id_), transmit[i], now_);
  }
}

void CanopenSlave::observe_pdos(PdoObserver observer) {
  const PdoRecord::Observer at_present = [this, observer = std::move(observer)](std::uint32_t cob_id,
                                                                                const Entry& entry) {
    observer(cob_id, entry, bus_now_);
  };
  for (auto& rpdo : rpdos_) rpdo->observe(at_present);
  for (auto& tpdo : tpdos_) tpdo->observe(at_present);
}

void CanopenSlave::use_fd() {
  fd_ = true;
  for (auto& rpdo : rpdos_) rpdo->use_fd();
  for (auto& tpdo : tpdos_) tpdo->use_fd();
}

// Hot: every node receives every frame of its bus, most of them not for it.
void CanopenSlave::receive(const can::Frame& frame, Time now) noexcept {
  set_time(now);
  if (frame.extended || frame.error) return;
  if (frame.id == LssSlave::kRequestId && !frame.remote && !frame.fd) {
    handle_lss(frame);
  } else if (state_ == NmtState::kBootUp || !handle_booted(frame)) {
    return;
  }
  schedule();
}

bool CanopenSlave::handle_booted(const can::Frame& frame) noexcept {
  if (frame.fd) return fd_ && state_ != NmtState::kStopped && handle_rpdo(frame);
  if (frame.remote) {
    handle_remote(frame);
  } else if (frame.id == canopen::cob_id::kNmt) {
    handle_nmt(frame);
  } else if (frame.id >= 0x701 && frame.id <= 0x77F) {
    handle_heartbeat(frame);
  } else {
    return state_ != NmtState::kStopped && handle_service(frame);
  }
  return true;
}

void CanopenSlave::handle_remote(const can::Frame& frame) noexcept {
  if (frame.id != canopen::cob_id::error_control(node_id_)) {
    before_sampling();
    for (auto& tpdo : tpdos_) tpdo->remote_request(frame.id, now_);
  } else if (!heartbeat_producer_.in_use() && guarding_.answer(state_, now_)) {
    master_found();
  }
}

bool CanopenSlave::handle_service(const can::Frame& frame) noexcept {
  if (frame.id == sync_.identifier()) {
    if (!sync_.length_fits(frame)) {
      raise(communication_error::kSyncLength, error_register::kCommunication);
    } else {
      handle_sync(frame.length == 0 ? std::uint8_t{0} : frame.data[0]);
    }
    return true;
  }
  if (frame.id == canopen::cob_id::sdo_request(node_id_)) {
    sdo_server_.receive(frame, now_);
    stop_missing_the_unwatched();
    return true;
  }
  if (clock_.accepts(frame)) {
    clock_.receive(frame, now_);
    return true;
  }
  return handle_rpdo(frame);
}

void CanopenSlave::handle_sync(std::uint8_t counter) noexcept {
  clear(communication_error::kSyncLength);
  on_sync();
  for (auto& tpdo : tpdos_) tpdo->sync(counter, now_);
  for (auto& rpdo : rpdos_) rpdo->sync();
  const Time window = sync_.window();
  window_ends_ = window_closes_ = window > Time{} ? now_ + window : Time::max();
}

bool CanopenSlave::handle_rpdo(const can::Frame& frame) noexcept {
  bool taken = false;
  for (auto& rpdo : rpdos_) {
    if (!rpdo->accepts(frame)) continue;
    taken = true;
    const ReceivePdo::Outcome outcome = rpdo->receive(frame, now_ > window_ends_, now_);
    if (outcome == ReceivePdo::Outcome::kTooShort) {
      raise(communication_error::kPdoTooShort, error_register::kCommunication);
      continue;
    }
    clear(communication_error::kPdoTooShort);
    if (outcome == ReceivePdo::Outcome::kRefused) continue;
    clear(communication_error::kRpdoTimeout);
    if (outcome == ReceivePdo::Outcome::kTakenTooLong) {
      raise(communication_error::kPdoTooLong, error_register::kCommunication);
    } else {
      clear(communication_error::kPdoTooLong);
    }
  }
  return taken;
}

void CanopenSlave::take() noexcept {
  outbox_.pop();
  if (sdo_server_.feeding()) sdo_server_.feed();
  // The boot-up message comes first, though its identifier is higher.
  if (emergency_.some_outlasted_reset() && !outbox_.holds(canopen::cob_id::error_control(node_id_))) {
    emergency_.announce(now_);
    schedule();
  }
  // The report of a full transmit queue needs a place in that queue.
  if (outbox_.overflows() != overflows_reported_ || active(communication_error::kOverrun)) {
    next_event_ = Time::min();
  }
}

void CanopenSlave::advance(Time now) noexcept {
  set_time(now);
  if (state_ == NmtState::kBootUp) {
    if (node_id_ != LssSlave::kUnconfigured) boot();
    return schedule();
  }
  if (next_event_ > now_) return;
  heartbeat_producer_.advance(now_, state_);
  if (heartbeat_consumer_.advance(now_)) {
    master_lost(heartbeat_consumer_.lost_node());
  }
  // A node that produces a heartbeat is not guarded (CiA 301, 7.2.8.2.2).
  if (guarding_.advance(now_)) heartbeat_producer_.in_use() ? guarding_.reset() : master_lost(0);
  if (sync_.advance(now_)) handle_sync(sync_.counter());
  if (window_closes_ <= now_) {
    window_closes_ = Time::max();
    for (auto& tpdo : tpdos_) tpdo->close_window();
  }
  for (auto& rpdo : rpdos_) {
    if (!rpdo->advance(now_)) continue;
    raise(communication_error::kRpdoTimeout, error_register::kCommunication);
    on_connection_lost(communication_error::kRpdoTimeout);
  }
  before_sampling();
  for (auto& tpdo : tpdos_) tpdo->advance(now_);
  watch_overrun();
  emergency_.advance(now_);
  sdo_server_.advance(now_);
  schedule();
}

void CanopenSlave::detune(double ppm) noexcept {
  oscillator_.detune(ppm, bus_now_);
  set_time(bus_now_);
}

void CanopenSlave::schedule() noexcept {
  next_event_ =
      std::min({heartbeat_producer_.next_event(), heartbeat_consumer_.next_event(), guarding_.next_event(),
                sync_.next_event(), window_closes_, emergency_.next_event(), sdo_server_.next_event()});
  for (const auto& rpdo : rpdos_) next_event_ = std::min(next_event_, rpdo->next_event());
  for (const auto& tpdo : tpdos_) next_event_ = std::min(next_event_, tpdo->next_event());
}

void CanopenSlave::signal_change(const Entry& entry) noexcept {
  for (auto& tpdo : tpdos_) tpdo->event(entry, now_);
  schedule();
}

void CanopenSlave::raise(std::uint16_t code, std::uint8_t register_bits) noexcept {
  emergency_.raise(code, register_bits, now_);
  schedule();
}

void CanopenSlave::clear(std::uint16_t code) noexcept {
  if (!emergency_.active(code)) return;
  emergency_.clear(code, now_);
  schedule();
}

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

void CanopenSlave::restart() noexcept {
  reset(true);
  schedule();
}

void CanopenSlave::leave_operational() noexcept {
  enter(NmtState::kPreOperational);
  schedule();
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
  set_time(now);
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
