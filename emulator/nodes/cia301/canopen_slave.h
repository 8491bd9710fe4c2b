#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "drivers/canopen/cob_id.h"
#include "emulator/bus/participant.h"
#include "emulator/nodes/cia301/emergency_producer.h"
#include "emulator/nodes/cia301/guarding.h"
#include "emulator/nodes/cia301/heartbeat.h"
#include "emulator/nodes/cia301/lss_slave.h"
#include "emulator/nodes/cia301/node_clock.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/oscillator.h"
#include "emulator/nodes/cia301/outbox.h"
#include "emulator/nodes/cia301/parameter_store.h"
#include "emulator/nodes/cia301/receive_pdo.h"
#include "emulator/nodes/cia301/sdo_server.h"
#include "emulator/nodes/cia301/sync.h"
#include "emulator/nodes/cia301/transmit_pdo.h"

namespace walkman::nodes {

/// Identity of a device: objects 1000h, 1008h-100Ah and 1018h. `serial` must differ from device to device.
struct DeviceIdentity {
  std::uint8_t node_id = 0;  ///< 1..127, factory setting
  std::uint32_t device_type = 0;
  std::string name;
  std::uint32_t product_code = 0;
  std::uint32_t serial = 0;
};

/// A CANopen device without its application (CiA 301): NMT slave, error control by heartbeat and by guarding,
/// SYNC, TIME, four RPDOs and four TPDOs, one SDO server, EMCY producer, store and restore, LSS slave
/// (CiA 305), and their objects. The application derives from it, adds its objects, and ends its constructor
/// with `configure_pdos`.
///
/// It has no clock: on a bus, `receive` and `advance` pass time in. Neither allocates.
class CanopenSlave : public bus::Participant {
 public:
  using PdoSet = std::array<PdoDefaults, 4>;

  void receive(const can::Frame& frame, Time now) noexcept final;
  /// The first call powers the node on: it sends its boot-up message and enters pre-operational.
  void advance(Time now) noexcept final;
  [[nodiscard]] Time next_event() const noexcept final { return oscillator_.when(next_event_); }
  [[nodiscard]] const can::Frame* pending() const noexcept final { return outbox_.front(); }
  void take() noexcept final;
  /// Error-passive is reported as 8120h. Bus-off empties the transmit queue and is a communication error
  /// (1029h:1, and the application's reaction); its end is reported as 8140h.
  void on_link_state(can::LinkState state, Time now) noexcept final;
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept final { return outbox_.overflows(); }

  /// Restarts the node, as after a short loss of power.
  void restart() noexcept;
  /// Makes the node enter NMT pre-operational by itself.
  void leave_operational() noexcept;
  /// Makes the node's clock fast by `ppm` from now on: its periods, deadlines and windows, but not those of
  /// the application.
  void detune(double ppm) noexcept;

  /// FFh: unconfigured (LSS).
  [[nodiscard]] std::uint8_t node_id() const noexcept { return node_id_; }
  [[nodiscard]] const std::string& name() const noexcept { return identity_.name; }
  [[nodiscard]] canopen::NmtState nmt_state() const noexcept { return state_; }
  [[nodiscard]] const ObjectDictionary& dictionary() const noexcept { return dictionary_; }

  [[nodiscard]] SdoServer& sdo_server() noexcept { return sdo_server_; }

  /// Calls `observer` with each object of a TPDO when it is sampled and of an RPDO when it has taken effect,
  /// for logs. `observer` must not throw.
  using PdoObserver = std::function<void(std::uint32_t cob_id, const Entry& entry, Time now)>;
  void observe_pdos(PdoObserver observer);

  /// For a bus with CAN FD: PDOs use FD frames and may have 64 bytes; every other service stays classical.
  /// Call before the first `advance`, at most once.
  void use_fd();
  /// Puts the device's own EDS into object 1021h. Call before the first `advance`.
  void store_eds(std::string text) { dictionary_.set_domain(0x1021, std::move(text)); }

 protected:
  /// Throws std::runtime_error for a node-ID outside 1..127.
  explicit CanopenSlave(DeviceIdentity identity);

  /// Creates the PDOs; the objects they map must have been added. Throws std::runtime_error if one cannot be
  /// mapped.
  void configure_pdos(const PdoSet& receive, const PdoSet& transmit);

  /// Called on SYNC, in any state that handles it; TPDOs are sampled and RPDOs take effect right after.
  virtual void on_sync() noexcept {}
  /// Called when TPDOs may be sampled right after, for a reason other than SYNC.
  virtual void before_sampling() noexcept {}
  /// Called when the command source is lost: heartbeat or life guarding (8130h), RPDO deadline (8250h), or 0
  /// for NMT stop, reset communication and bus-off.
  virtual void on_connection_lost(std::uint16_t /*error_code*/) noexcept {}
  /// Called on NMT reset node: application objects have their power-on values.
  virtual void on_reset() noexcept {}

  /// Reports that the value of `entry` has changed: event-driven TPDOs that map it are sent.
  void signal_change(const Entry& entry) noexcept;
  /// Reports EMCY `code` once and sets `register_bits` of 1001h together with the generic bit.
  void raise(std::uint16_t code, std::uint8_t register_bits) noexcept;
  /// Ends error `code`, and sends EMCY 0000h if none is left.
  void clear(std::uint16_t code) noexcept;
  /// Whether error `code` is present.
  [[nodiscard]] bool active(std::uint16_t code) const noexcept { return emergency_.active(code); }
  [[nodiscard]] ObjectDictionary& objects() noexcept { return dictionary_; }

 private:
  void add_communication_objects();
  /// Handles all frames but LSS; returns false for a frame that is not for this node.
  [[nodiscard]] bool handle_booted(const can::Frame& frame) noexcept;
  void handle_remote(const can::Frame& frame) noexcept;
  /// Handles SYNC, TIME, SDO and RPDOs; returns false for a frame that is not for this node.
  [[nodiscard]] bool handle_service(const can::Frame& frame) noexcept;
  void handle_sync(std::uint8_t counter) noexcept;
  [[nodiscard]] bool handle_rpdo(const can::Frame& frame) noexcept;
  void schedule() noexcept;
  void set_time(Time bus_now) noexcept {
    bus_now_ = bus_now;
    now_ = oscillator_.local(bus_now);
  }

  // NMT states, error control, fault confinement
  void handle_nmt(const can::Frame& frame) noexcept;
  void handle_heartbeat(const can::Frame& frame) noexcept;
  void handle_lss(const can::Frame& frame) noexcept;
  void enter(canopen::NmtState state) noexcept;
  void reset(bool application) noexcept;
  void boot() noexcept;
  void take_node_id(std::uint8_t node_id) noexcept;
  void master_lost(std::uint8_t node) noexcept;
  void master_found() noexcept;
  /// Ends 8130h if what was lost is no longer watched.
  void stop_missing_the_unwatched() noexcept;
  void react_to_communication_error() noexcept;
  void watch_overrun() noexcept;

  DeviceIdentity identity_;
  std::uint8_t node_id_;        // in use
  std::uint8_t cob_id_offset_;  // node-ID that the factory settings of the COB-IDs contain
  bool fd_ = false;
  Oscillator oscillator_;
  Time bus_now_{};
  // On the node's own clock, as all times that follow.
  Time now_{};
  Time next_event_ = Time::min();
  canopen::NmtState state_ = canopen::NmtState::kBootUp;
  can::LinkState link_ = can::LinkState::kActive;
  std::uint64_t overflows_reported_ = 0;
  Time window_ends_ = Time::max();    // window for the synchronous PDOs of the last SYNC
  Time window_closes_ = Time::max();  // the same, until TPDOs still waiting have been dropped

  ObjectDictionary dictionary_;
  Outbox outbox_;
  Sync sync_;
  NodeClock clock_;
  Object<std::uint8_t> error_behaviour_;
  Object<std::uint32_t> start_up_;
  EmergencyProducer emergency_;
  HeartbeatProducer heartbeat_producer_;
  HeartbeatConsumer heartbeat_consumer_;
  NodeGuarding guarding_;
  SdoServer sdo_server_;
  ParameterStore parameter_store_;
  LssSlave lss_;
  std::array<std::unique_ptr<ReceivePdo>, 4> rpdos_;
  std::array<std::unique_ptr<TransmitPdo>, 4> tpdos_;
};

}  // namespace walkman::nodes
