#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/emcy_message.h"
#include "drivers/canopen/fault_cause.h"
#include "drivers/canopen/node_settings.h"
#include "drivers/canopen/pdo_protection.h"
#include "drivers/canopen/sdo_client.h"
#include "drivers/canopen/sdo_sequence.h"

namespace walkman::canopen {

/// Longest time an SDO request may take. CiA 301 leaves it to the application; servers answer within a cycle.
inline constexpr Time kSdoTimeout = std::chrono::milliseconds(200);

/// Age of data stamped `at`: `Time::max()` if there has been none, never negative.
[[nodiscard]] inline Time age_of(Time at, Time now) noexcept {
  return at == Time::min() ? Time::max() : std::max(Time{0}, now - at);
}

/// A device of the robot as seen by its master, with everything common to all devices: SDO channel,
/// configuration, boot-up, heartbeat, EMCY, data ages, and the order in which these are judged. Derived
/// classes define what its PDOs mean, what it needs to be in operation and what can be wrong with it.
///
/// `configure` configures it, `receive` passes it frames and `poll` the time, `judge` judges it; its state is
/// the sample of its class. Commanded devices (drives) also implement the power-up and set-point calls, which
/// do nothing for a sensor.
class RemoteNode {
 public:
  enum class Stage {
    kAwaitingBootUp,  ///< nothing heard yet
    kConfiguring,     ///< SDO configuration in progress
    kConfigured,      ///< waiting for NMT start
    kStarted,         ///< NMT start sent
    kLost,            ///< booted up again unexpectedly; takes no commands until rebooted
    kStopped,         ///< NMT stop sent
  };

  virtual ~RemoteNode() = default;
  RemoteNode(const RemoteNode&) = delete;
  RemoteNode& operator=(const RemoteNode&) = delete;

  [[nodiscard]] const NodeSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::uint8_t node_id() const noexcept { return settings_.node_id; }
  /// "drive RShSag (node 11 on can_rarm)".
  [[nodiscard]] std::string label() const;

  /// Forgets everything and waits for the boot-up message. `now`: time at which the master reset the bus.
  void begin_boot(Time now) noexcept;

  /// Performs one step of the configuration over SDO; a boot-up message starts or restarts it. Returns true
  /// once configured.
  /// Throws std::runtime_error with node, object, the value found and the one expected. Also if even the
  /// quickest answer took longer than cyclic data may be old: frames that are all late by the same time still
  /// arrive once a cycle, and only a request and its answer show by how much.
  bool configure(Time now);

  /// Notes that NMT reset, NMT start or NMT stop was sent to the node.
  void reset_sent() noexcept;
  void start(Time now) noexcept;
  void stop() noexcept { stage_ = Stage::kStopped; }
  /// Notes that SYNC was sent.
  void sync_sent() noexcept {
    ++syncs_;
    frames_since_sync_ = 0;
  }
  /// Notes that `sdo().pending()` was sent.
  void request_sent() noexcept;

  /// Takes a frame with one of the node's transmit COB-IDs of the predefined connection set.
  /// Returns false if it has the wrong length, is of an unknown kind or is not a plain data frame; it then
  /// has no effect. A protected PDO that fails its check is still the node's own: the result is true, but it
  /// has no other effect.
  bool receive(const can::StampedFrame& frame, Time now) noexcept;

  /// Call once per cycle after receiving: SDO time-outs, background requests, ages.
  virtual void poll(Time now) noexcept;

  /// Returns the first fault found in operation, causes before consequences: boot-up, emergency, the device's
  /// own state, NMT state, heartbeat, failed request, stale data, implausible values.
  [[nodiscard]] std::optional<FaultCause> judge(Time now) const noexcept;
  /// Returns a cause if a synchronous TPDO is older than the limit.
  [[nodiscard]] std::optional<cause::NoTpdo> stale(Time now) const noexcept;
  /// Whether there was no heartbeat for longer than `NodeSettings::heartbeat_timeout`.
  [[nodiscard]] bool heartbeat_lost(Time now) const noexcept;
  /// What keeps the device from operation, as text for users, e.g. "no TPDO2"; empty if nothing does.
  [[nodiscard]] std::string what_is_missing() const;
  /// Whether everything needed for operation is there: complete samples; for a drive also operation enabled
  /// and its mode.
  [[nodiscard]] virtual bool in_operation() const noexcept = 0;
  /// A condition to warn about that is not a fault: one sentence without the device's name; empty if none.
  [[nodiscard]] virtual std::string warning() const { return {}; }
  /// Meaning of an emergency error code from this device: according to its profile and its manufacturer,
  /// otherwise to CiA 301. Empty if it is unknown here.
  [[nodiscard]] virtual std::string_view error_text(std::uint16_t code) const noexcept {
    return communication_error_text(code);
  }

  /// Begins the transition into operation (CiA 402: to operation enabled); a device already there is
  /// unaffected.
  virtual void begin_power_up() noexcept {}
  /// Performs one step of it, based on the newest TPDOs; the command is sent with the next RPDOs.
  virtual void power_up() noexcept {}
  /// Ends the transition: set-points start from the device's position.
  virtual void end_power_up() noexcept {}
  /// Stops the set-point at its present value.
  virtual void hold() noexcept {}
  /// Advances the set-point by one period of the device's PDOs.
  virtual void advance() noexcept {}
  /// From now on commands the device to stop.
  virtual void quick_stop() noexcept {}
  /// Writes RPDO `number` 1..4 with the present command, protected if the layout says so, to be sent now.
  /// Returns false if there is none.
  [[nodiscard]] bool next_rpdo(int number, can::Frame& out) noexcept;
  /// Whether that RPDO carries the command that makes the device stop.
  [[nodiscard]] virtual bool carries_stop(int /*number*/) const noexcept { return false; }
  /// n if its PDOs are sent with every n-th SYNC.
  [[nodiscard]] int sync_divider() const noexcept;

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] SdoClient& sdo() noexcept { return sdo_; }
  /// State last reported by the node; a PDO after NMT start shows that it is operational.
  [[nodiscard]] NmtState nmt_state() const noexcept { return nmt_state_; }

  /// Stamp of the newest TPDO `number`; `Time::min()` before the first since the boot began.
  [[nodiscard]] Time tpdo_at(int number) const noexcept { return tpdos_[index_of(number)].at; }
  /// Whether every synchronous TPDO has arrived at least once.
  [[nodiscard]] bool has_cyclic_data() const noexcept;
  /// Oldest of the stamps of the newest synchronous TPDOs; `Time::min()` if one is missing.
  [[nodiscard]] Time cyclic_data_at() const noexcept;
  /// Newest of these stamps; `Time::min()` before the first.
  [[nodiscard]] Time newest_cyclic_at() const noexcept;

  /// Whether everything that the SYNCs sent so far must have triggered has arrived: the boot-up after an NMT
  /// reset, the answer to an SDO request sent before the last SYNC, the TPDOs due with it. What has
  /// repeatedly failed to arrive is no longer waited for.
  [[nodiscard]] bool cycle_complete() const noexcept;

  /// Stamp of the newest frame of any kind; `Time::min()` before the first since the boot began.
  [[nodiscard]] Time heard_at() const noexcept { return heard_at_; }
  /// Frames received since the last SYNC was sent.
  [[nodiscard]] int frames_since_sync() const noexcept { return frames_since_sync_; }

  /// Time since the last heartbeat (or the NMT start, whichever is later).
  [[nodiscard]] Time heartbeat_age(Time now) const noexcept;

  /// Emergencies with an error code since construction.
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  /// Clears the latched emergency and failed request, and everything latched by derived classes.
  virtual void clear_events() noexcept;

 protected:
  explicit RemoteNode(NodeSettings settings);

  /// Sets the steps that `configure` performs; call before anything else.
  void set_configuration(std::vector<SdoStep> steps) { configuration_ = SdoSequence(std::move(steps)); }

  /// Writes RPDO `number` 1..4 with the present command. Returns false if there is none.
  [[nodiscard]] virtual bool rpdo(int /*number*/, can::Frame& /*out*/) const noexcept { return false; }
  /// Called when PDO `number` 1..4 has arrived, with at least the bytes of its mapping.
  virtual void on_tpdo(int number, const can::StampedFrame& frame) noexcept = 0;
  /// Called when the node is about to be booted: forget all samples.
  virtual void on_begin_boot() noexcept = 0;
  /// Fault in the device's own state, which causes many others.
  [[nodiscard]] virtual std::optional<FaultCause> judge_state() const noexcept { return std::nullopt; }
  /// Fault in the values it sends.
  [[nodiscard]] virtual std::optional<FaultCause> judge_values(Time now) const noexcept = 0;
  /// `what_is_missing` for a device whose TPDOs all arrive.
  [[nodiscard]] virtual std::string what_samples_miss() const = 0;

  void latch_request_failure() noexcept;
  /// Where the configuration stores 1018h:1.
  [[nodiscard]] std::uint32_t* vendor_place() noexcept { return &vendor_; }
  /// 1018h:1 as reported by the device at boot; 0 before.
  [[nodiscard]] std::uint32_t vendor() const noexcept { return vendor_; }

 private:
  struct Tpdo {
    std::size_t bytes = 0;
    int divider = 0;
    Time at = Time::min();
    std::uint64_t due = 0;  // number of the SYNC with which it is due next
    bool protects = false;
    PdoGuard guard;
    std::uint64_t refused = 0;  // since `at`
  };
  [[nodiscard]] static std::size_t index_of(int number) noexcept {
    return static_cast<std::size_t>(number - 1);
  }
  void require_prompt_answers() const;
  bool take(const can::StampedFrame& frame, Time now) noexcept;
  bool receive_tpdo(const can::StampedFrame& frame) noexcept;
  bool on_error_control(const can::StampedFrame& frame) noexcept;
  /// The last heartbeat says so, and not because of flipped bits: the one before says so, too, or no TPDO
  /// follows it, which only an operational node sends (CiA 301, 7.3.2.2).
  [[nodiscard]] bool left_operational(Time now) const noexcept;
  /// Whether something has been due since the SYNC `since`, for no longer than `longest` SYNCs.
  [[nodiscard]] bool overdue(std::uint64_t since, std::uint64_t longest) const noexcept {
    return syncs_ >= since && syncs_ - since < longest;
  }

  NodeSettings settings_;
  SdoClient sdo_;
  SdoSequence configuration_{std::vector<SdoStep>{}};
  std::array<Tpdo, 4> tpdos_{};
  std::array<std::uint8_t, 4> rpdo_counts_{};        // counts of protected RPDOs
  std::array<std::uint8_t, 16> tpdo_of_function_{};  // TPDO by function code: 1..4, or 0

  std::uint64_t syncs_ = 0;
  std::uint64_t reset_at_ = 0, request_at_ = 0;  // SYNCs sent before it
  Time heartbeat_at_{};
  Time heard_at_ = Time::min();
  Time quickest_answer_ = Time::max();  // to a request of the configuration
  int frames_since_sync_ = 0;
  int odd_heartbeats_ = 0;  // in a row, with a state other than operational
  std::uint64_t emergencies_ = 0;
  std::optional<EmcyMessage> emergency_;  // the first since `clear_events`
  std::optional<cause::RequestFailed> request_failed_;
  std::uint32_t vendor_ = 0;
  Stage stage_ = Stage::kAwaitingBootUp;
  NmtState nmt_state_ = NmtState::kBootUp;
  bool boot_up_ = false;
  bool reset_sent_ = false;
  bool operational_seen_ = false;
};

}  // namespace walkman::canopen
