#include "emulator/nodes/canopen_slave.h"

#include <algorithm>
#include <stdexcept>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/objects.h"
#include "emulator/nodes/cob_id_rules.h"

namespace walkman::nodes {

using canopen::NmtCommand;
using canopen::NmtState;
namespace object = canopen::object;

namespace {

// CiA has assigned no number to this project; masters take 0 for a device without an identity.
constexpr std::uint32_t kVendor = 0x4B4C4157;
constexpr std::uint32_t kRevision = 0x00010000;

constexpr std::uint16_t kHeartbeatLost = 0x8130;
constexpr std::uint16_t kPdoTooShort = 0x8210;
constexpr std::uint16_t kPdoTooLong = 0x8220;
constexpr std::uint16_t kSyncLength = 0x8240;
constexpr std::uint16_t kRpdoTimeout = 0x8250;

DeviceIdentity checked(DeviceIdentity identity) {
  if (identity.node_id < 1 || identity.node_id > 127) {
    throw std::runtime_error("device " + identity.name + ": node-ID " + std::to_string(identity.node_id) +
                             ", expected 1 to 127");
  }
  return identity;
}

}  // namespace

CanopenSlave::CanopenSlave(DeviceIdentity identity)
    : identity_(checked(std::move(identity))),
      emergency_(dictionary_, outbox_, identity_.node_id),
      heartbeat_producer_(dictionary_, outbox_, identity_.node_id, now_),
      heartbeat_consumer_(dictionary_),
      sdo_server_(dictionary_, outbox_, identity_.node_id) {
  add_communication_objects();
}

void CanopenSlave::add_communication_objects() {
  dictionary_.add<std::uint32_t>(object::kDeviceType, 0, Access::kReadOnly, identity_.device_type);
  sync_cob_id_ =
      dictionary_.add<std::uint32_t>(object::kSyncCobId, 0, Access::kReadWrite, canopen::cob_id::kSync);
  // An emulated device does not generate SYNC (bit 30).
  sync_cob_id_.on_write([](std::uint32_t value) -> Verdict {
    if (value > kCobIdMask || restricted_identifier(value)) return SdoAbort::kValue;
    return std::nullopt;
  });
  dictionary_.add_text(0x1008, 0, identity_.name);
  dictionary_.add_text(0x1009, 0, "emulated");
  dictionary_.add_text(0x100A, 0, "1.0");
  dictionary_.add<std::uint8_t>(object::kIdentity, 0, Access::kConst, 4);
  dictionary_.add<std::uint32_t>(object::kIdentity, 1, Access::kReadOnly, kVendor);
  dictionary_.add<std::uint32_t>(object::kIdentity, 2, Access::kReadOnly, identity_.product_code);
  dictionary_.add<std::uint32_t>(object::kIdentity, 3, Access::kReadOnly, kRevision);
  dictionary_.add<std::uint32_t>(object::kIdentity, 4, Access::kReadOnly, identity_.serial);
  dictionary_.add<std::uint8_t>(object::kErrorBehaviour, 0, Access::kConst, 1);
  error_behaviour_ =
      dictionary_.add<std::uint8_t>(object::kErrorBehaviour, 1, Access::kReadWrite, 0).limits(0, 2);
}

void CanopenSlave::configure_pdos(const PdoSet& receive, const PdoSet& transmit) {
  for (std::size_t i = 0; i < 4; ++i) {
    const int number = static_cast<int>(i) + 1;
    rpdos_[i] = std::make_unique<ReceivePdo>(dictionary_, number, canopen::cob_id::rpdo(number, node_id()),
                                             receive[i]);
    tpdos_[i] = std::make_unique<TransmitPdo>(dictionary_, outbox_, number,
                                              canopen::cob_id::tpdo(number, node_id()), transmit[i], now_);
  }
}

void CanopenSlave::observe_pdos(PdoObserver observer) {
  const PdoRecord::Observer at_present = [this, observer = std::move(observer)](std::uint32_t cob_id,
                                                                                const Entry& entry) {
    observer(cob_id, entry, now_);
  };
  for (auto& rpdo : rpdos_) rpdo->observe(at_present);
  for (auto& tpdo : tpdos_) tpdo->observe(at_present);
}

void CanopenSlave::receive(const can::Frame& frame, Time now) noexcept {
  now_ = now;
  if (frame.extended || frame.fd || state_ == NmtState::kBootUp) return;
  if (frame.remote) {
    for (auto& tpdo : tpdos_) tpdo->remote_request(frame.id, now_);
  } else if (frame.id == canopen::cob_id::kNmt) {
    handle_nmt(frame);
  } else if (frame.id >= 0x701 && frame.id <= 0x77F) {
    handle_heartbeat(frame);
  } else if (state_ == NmtState::kStopped || !handle_service(frame)) {
    return;
  }
  schedule();
}

bool CanopenSlave::handle_service(const can::Frame& frame) noexcept {
  if (frame.id == sync_cob_id_.get()) {
    handle_sync(frame);
    return true;
  }
  if (frame.id == canopen::cob_id::sdo_request(node_id())) {
    sdo_server_.receive(frame, now_);
    return true;
  }
  return handle_rpdo(frame);
}

void CanopenSlave::handle_nmt(const can::Frame& frame) noexcept {
  if (frame.length != 2 || (frame.data[1] != 0 && frame.data[1] != node_id())) return;
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
  if (state == NmtState::kOperational) {
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
  dictionary_.restore_defaults(0x1000, application ? 0xFFFF : 0x1FFF);
  for (auto& rpdo : rpdos_) rpdo->reload();
  for (auto& tpdo : tpdos_) tpdo->reload();
  outbox_.clear();
  emergency_.reset();
  heartbeat_consumer_.reset();
  sdo_server_.reset();
  if (application) {
    on_reset();
  } else {
    on_connection_lost(0);
  }
  state_ = NmtState::kPreOperational;
  emergency_.enable(true);
  heartbeat_producer_.boot_up(now_);
}

void CanopenSlave::handle_sync(const can::Frame& frame) noexcept {
  if (frame.length != 0) return raise(kSyncLength, error_register::kCommunication);
  clear(kSyncLength);
  on_sync();
  for (auto& tpdo : tpdos_) tpdo->sync(now_);
  for (auto& rpdo : rpdos_) rpdo->sync();
}

void CanopenSlave::handle_heartbeat(const can::Frame& frame) noexcept {
  if (frame.length != 1) return;
  const auto node = static_cast<std::uint8_t>(frame.id - canopen::cob_id::error_control(0));
  if (heartbeat_consumer_.beat(node, now_) == HeartbeatConsumer::Change::kRecovered) clear(kHeartbeatLost);
}

bool CanopenSlave::handle_rpdo(const can::Frame& frame) noexcept {
  bool taken = false;
  for (auto& rpdo : rpdos_) {
    if (!rpdo->accepts(frame)) continue;
    taken = true;
    const ReceivePdo::Outcome outcome = rpdo->receive(frame, now_);
    if (outcome == ReceivePdo::Outcome::kTooShort) {
      raise(kPdoTooShort, error_register::kCommunication);
      continue;
    }
    clear(kPdoTooShort);
    clear(kRpdoTimeout);
    if (outcome == ReceivePdo::Outcome::kTakenTooLong) {
      raise(kPdoTooLong, error_register::kCommunication);
    } else {
      clear(kPdoTooLong);
    }
  }
  return taken;
}

void CanopenSlave::heartbeat_lost() noexcept {
  const std::array<std::uint8_t, 1> node{heartbeat_consumer_.lost_node()};
  emergency_.raise(kHeartbeatLost, error_register::kCommunication, node, now_);
  on_connection_lost(kHeartbeatLost);
  // Error behaviour 1029h:1.
  if (error_behaviour_.get() == 0 && state_ == NmtState::kOperational) enter(NmtState::kPreOperational);
  if (error_behaviour_.get() == 2) enter(NmtState::kStopped);
}

void CanopenSlave::advance(Time now) noexcept {
  now_ = now;
  if (state_ == NmtState::kBootUp) {
    state_ = NmtState::kPreOperational;
    emergency_.enable(true);
    heartbeat_producer_.boot_up(now_);
    return schedule();
  }
  if (next_event_ > now) return;
  heartbeat_producer_.advance(now_, state_);
  if (heartbeat_consumer_.advance(now_) == HeartbeatConsumer::Change::kLost) heartbeat_lost();
  for (auto& rpdo : rpdos_) {
    if (!rpdo->advance(now_)) continue;
    raise(kRpdoTimeout, error_register::kCommunication);
    on_connection_lost(kRpdoTimeout);
  }
  for (auto& tpdo : tpdos_) tpdo->advance(now_);
  emergency_.advance(now_);
  sdo_server_.advance(now_);
  schedule();
}

void CanopenSlave::schedule() noexcept {
  next_event_ = std::min({heartbeat_producer_.next_event(), heartbeat_consumer_.next_event(),
                          emergency_.next_event(), sdo_server_.next_event()});
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

}  // namespace walkman::nodes
