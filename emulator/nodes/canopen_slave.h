#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "drivers/canopen/nmt.h"
#include "emulator/bus/participant.h"
#include "emulator/nodes/emergency.h"
#include "emulator/nodes/heartbeat.h"
#include "emulator/nodes/object_dictionary.h"
#include "emulator/nodes/outbox.h"
#include "emulator/nodes/receive_pdo.h"
#include "emulator/nodes/sdo_server.h"
#include "emulator/nodes/transmit_pdo.h"

namespace walkman::nodes {

/// What a device says it is: objects 1000h, 1008h-100Ah and 1018h.
struct DeviceIdentity {
  std::uint8_t node_id = 0;  ///< 1..127
  std::uint32_t device_type = 0;
  std::string name;
  std::uint32_t product_code = 0;
  std::uint32_t serial = 0;
};

/// A CANopen device without its application (CiA 301): NMT slave, error control, SYNC consumer, four RPDOs
/// and four TPDOs, one SDO server, EMCY producer, and their objects. The application derives, adds its
/// objects, and ends its constructor with `configure_pdos`.
///
/// It holds no clock: on a bus, `receive` and `advance` push time in.
class CanopenSlave : public bus::Participant {
 public:
  using PdoSet = std::array<PdoDefaults, 4>;

  void receive(const can::Frame& frame, Time now) noexcept final;
  /// The first call powers the node on: it sends its boot-up message and is pre-operational.
  void advance(Time now) noexcept final;
  [[nodiscard]] Time next_event() const noexcept final { return next_event_; }
  [[nodiscard]] const can::Frame* pending() const noexcept final { return outbox_.front(); }
  void take() noexcept final { outbox_.pop(); }
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept final { return outbox_.overflows(); }

  [[nodiscard]] std::uint8_t node_id() const noexcept { return identity_.node_id; }
  [[nodiscard]] const std::string& name() const noexcept { return identity_.name; }
  [[nodiscard]] canopen::NmtState nmt_state() const noexcept { return state_; }
  [[nodiscard]] const ObjectDictionary& dictionary() const noexcept { return dictionary_; }

  /// Calls `observer` with each object of a TPDO when it is sampled and of an RPDO when it has taken effect,
  /// for logs. Must not throw.
  using PdoObserver = std::function<void(std::uint32_t cob_id, const Entry& entry, Time now)>;
  void observe_pdos(PdoObserver observer);

 protected:
  /// Throws std::runtime_error for a node-ID outside 1..127.
  explicit CanopenSlave(DeviceIdentity identity);

  /// Creates the PDOs; the objects they map must have been added. Throws std::runtime_error when one cannot
  /// be mapped.
  void configure_pdos(const PdoSet& receive, const PdoSet& transmit);

  /// A SYNC has come, in any state that listens to it; TPDOs are sampled and RPDOs take effect right after.
  virtual void on_sync() noexcept {}
  /// The command source is lost: heartbeat (8130h), RPDO deadline (8250h), or 0 for NMT stop.
  virtual void on_connection_lost(std::uint16_t /*error_code*/) noexcept {}
  /// NMT reset node: application objects have their defaults again.
  virtual void on_reset() noexcept {}

  /// Tells that the value of `entry` has changed: event-driven TPDOs that map it are sent.
  void signal_change(const Entry& entry) noexcept;
  void raise(std::uint16_t code, std::uint8_t register_bits) noexcept;
  void clear(std::uint16_t code) noexcept;
  [[nodiscard]] bool active(std::uint16_t code) const noexcept { return emergency_.active(code); }
  [[nodiscard]] ObjectDictionary& objects() noexcept { return dictionary_; }

 private:
  void add_communication_objects();
  void handle_nmt(const can::Frame& frame) noexcept;
  /// SYNC, SDO and RPDOs; false for a frame that is not for this node.
  [[nodiscard]] bool handle_service(const can::Frame& frame) noexcept;
  void handle_sync(const can::Frame& frame) noexcept;
  void handle_heartbeat(const can::Frame& frame) noexcept;
  [[nodiscard]] bool handle_rpdo(const can::Frame& frame) noexcept;
  void enter(canopen::NmtState state) noexcept;
  void reset(bool application) noexcept;
  void heartbeat_lost() noexcept;
  void schedule() noexcept;

  DeviceIdentity identity_;
  Time now_{};
  Time next_event_ = Time::min();
  canopen::NmtState state_ = canopen::NmtState::kBootUp;

  ObjectDictionary dictionary_;
  Outbox outbox_;
  Object<std::uint32_t> sync_cob_id_;
  Object<std::uint8_t> error_behaviour_;
  Emergency emergency_;
  HeartbeatProducer heartbeat_producer_;
  HeartbeatConsumer heartbeat_consumer_;
  SdoServer sdo_server_;
  std::array<std::unique_ptr<ReceivePdo>, 4> rpdos_;
  std::array<std::unique_ptr<TransmitPdo>, 4> tpdos_;
};

}  // namespace walkman::nodes
