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

/// How long a request over SDO may take. CiA 301 leaves it to the application; servers answer within a cycle.
inline constexpr Time kSdoTimeout = std::chrono::milliseconds(200);

/// Age of data stamped `at`: `Time::max()` when there has been none, never negative.
[[nodiscard]] inline Time age_of(Time at, Time now) noexcept {
  return at == Time::min() ? Time::max() : std::max(Time{0}, now - at);
}

/// A device of the robot as its master sees it, and what all of them have in common: SDO channel,
/// configuration, boot-up, heartbeat, EMCY, ages, the order in which they are judged. What its PDOs mean,
/// what it needs to be in operation and what can be wrong with it is the business of the classes derived from
/// it.
///
/// Configured by `configure`; takes frames by `receive` and time by `poll`; judged by `judge`; its state is
/// its class's sample. Commanded devices (drives) answer the power-up and set-point calls too, which a sensor
/// leaves alone.
class RemoteNode {
 public:
  enum class Stage {
    kAwaitingBootUp,  ///< nothing heard yet
    kConfiguring,     ///< SDO conversation under way
    kConfigured,      ///< waiting for NMT start
    kStarted,         ///< NMT start sent
    kLost,            ///< booted up again unasked; takes no commands until booted anew
    kStopped,         ///< NMT stop sent
  };

  virtual ~RemoteNode() = default;
  RemoteNode(const RemoteNode&) = delete;
  RemoteNode& operator=(const RemoteNode&) = delete;

  [[nodiscard]] const NodeSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::uint8_t node_id() const noexcept { return settings_.node_id; }
  /// "drive RShSag (node 11 on can_rarm)".
  [[nodiscard]] std::string label() const;

  /// Forgets everything and waits for the boot-up message. `now`: when the master reset the bus.
  void begin_boot(Time now) noexcept;

  /// One step of the configuration over SDO; a boot-up message begins it (anew). True once configured.
  /// Throws std::runtime_error: node, object, what was found and what was expected.
  bool configure(Time now);

  /// Tells the node that NMT reset, NMT start or NMT stop was sent to it.
  void reset_sent() noexcept;
  void start(Time now) noexcept;
  void stop() noexcept { stage_ = Stage::kStopped; }
  /// Tells the node that SYNC was sent.
  void sync_sent() noexcept {
    ++syncs_;
    frames_since_sync_ = 0;
  }
  /// Tells the node that its `sdo().pending()` was sent.
  void request_sent() noexcept;

  /// Takes a frame with one of the node's transmit COB-IDs of the predefined connection set.
  /// False when it was of the wrong length, of an unknown kind or no plain data frame; it is then without
  /// effect. A protected PDO that does not fit is the node's own, so true, but of no other effect.
  bool receive(const can::StampedFrame& frame, Time now) noexcept;

  /// Once a cycle after receiving: SDO time-outs, background requests, ages.
  virtual void poll(Time now) noexcept;

  /// First thing that is wrong in operation, causes before consequences: boot-up, emergency, the device's own
  /// state, NMT state, heartbeat, failed request, stale data, implausible values.
  [[nodiscard]] std::optional<FaultCause> judge(Time now) const noexcept;
  /// A TPDO that comes with SYNC is older than the limit.
  [[nodiscard]] std::optional<cause::NoTpdo> stale(Time now) const noexcept;
  /// No heartbeat for longer than `NodeSettings::heartbeat_timeout`.
  [[nodiscard]] bool heartbeat_lost(Time now) const noexcept;
  /// What keeps the device from operation, for people, e.g. "no TPDO2"; empty when nothing does.
  [[nodiscard]] std::string what_is_missing() const;
  /// Has all that operation needs: complete samples; of a drive also operation enabled and its mode.
  [[nodiscard]] virtual bool in_operation() const noexcept = 0;
  /// What is not well but no fault, one sentence without the device's name; empty when all is.
  [[nodiscard]] virtual std::string warning() const { return {}; }
  /// What an emergency error code means from this device: its profile's word and its manufacturer's, else
  /// that of CiA 301. Empty when nobody here knows.
  [[nodiscard]] virtual std::string_view error_text(std::uint16_t code) const noexcept {
    return communication_error_text(code);
  }

  /// A walk into operation begins (CiA 402: to operation enabled); one who is there stays as it is.
  virtual void begin_power_up() noexcept {}
  /// One step of it, judged by the newest TPDOs; the command goes out with the next RPDOs.
  virtual void power_up() noexcept {}
  /// The walk has ended: set-points begin from where the device stands.
  virtual void end_power_up() noexcept {}
  /// The set-point stands still where it is.
  virtual void hold() noexcept {}
  /// The set-point goes on by one period of the device's PDOs.
  virtual void advance() noexcept {}
  /// From now on the device is told to stop.
  virtual void quick_stop() noexcept {}
  /// RPDO `number` 1..4 with the present command, protected where the layout says so, to be sent now. False
  /// when there is none.
  [[nodiscard]] bool next_rpdo(int number, can::Frame& out) noexcept;
  /// That RPDO carries what makes the device stop.
  [[nodiscard]] virtual bool carries_stop(int /*number*/) const noexcept { return false; }
  /// Its PDOs travel with every n-th SYNC.
  [[nodiscard]] int sync_divider() const noexcept;

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] SdoClient& sdo() noexcept { return sdo_; }
  /// As the node last told it; a PDO after NMT start tells it is operational.
  [[nodiscard]] NmtState nmt_state() const noexcept { return nmt_state_; }

  /// Stamp of the newest TPDO `number`; `Time::min()` before the first since the boot began.
  [[nodiscard]] Time tpdo_at(int number) const noexcept { return tpdos_[index_of(number)].at; }
  /// Every TPDO that comes with SYNC has come at least once.
  [[nodiscard]] bool has_cyclic_data() const noexcept;
  /// Stamp of the oldest of the newest TPDOs that come with SYNC; `Time::min()` when one is missing.
  [[nodiscard]] Time cyclic_data_at() const noexcept;
  /// Stamp of the newest of them; `Time::min()` before the first.
  [[nodiscard]] Time newest_cyclic_at() const noexcept;

  /// Nothing is outstanding that the SYNCs sent so far must have brought about: the boot-up after an NMT
  /// reset, the answer to an SDO request sent before the last SYNC, the TPDOs due with it. What has failed to
  /// come several times over is not waited for any more.
  [[nodiscard]] bool cycle_complete() const noexcept;

  /// Stamp of the newest frame of any kind; `Time::min()` before the first since the boot began.
  [[nodiscard]] Time heard_at() const noexcept { return heard_at_; }
  /// Frames received since the last SYNC was sent.
  [[nodiscard]] int frames_since_sync() const noexcept { return frames_since_sync_; }

  /// Time since the last heartbeat (or the NMT start, whichever is later).
  [[nodiscard]] Time heartbeat_age(Time now) const noexcept;

  /// Emergencies with an error code since construction.
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  /// Forgets the latched emergency, failed request and what derived classes latch.
  virtual void clear_events() noexcept;

 protected:
  explicit RemoteNode(NodeSettings settings);

  /// Before anything else; what `configure` runs through.
  void set_configuration(std::vector<SdoStep> steps) { configuration_ = SdoSequence(std::move(steps)); }

  /// RPDO `number` 1..4 with the present command. False when there is none.
  [[nodiscard]] virtual bool rpdo(int /*number*/, can::Frame& /*out*/) const noexcept { return false; }
  /// PDO `number` 1..4 arrived, with at least the bytes of its mapping.
  virtual void on_tpdo(int number, const can::StampedFrame& frame) noexcept = 0;
  /// The node is about to be booted: forget all samples.
  virtual void on_begin_boot() noexcept = 0;
  /// What is wrong with the device's own state, a cause of much else.
  [[nodiscard]] virtual std::optional<FaultCause> judge_state() const noexcept { return std::nullopt; }
  /// What is wrong with the values it sends.
  [[nodiscard]] virtual std::optional<FaultCause> judge_values(Time now) const noexcept = 0;
  /// `what_is_missing` of a device whose TPDOs all come.
  [[nodiscard]] virtual std::string what_samples_miss() const = 0;

  void latch_request_failure() noexcept;
  /// Where the configuration leaves 1018h:1.
  [[nodiscard]] std::uint32_t* vendor_place() noexcept { return &vendor_; }
  /// 1018h:1 as the device told it at boot; 0 before.
  [[nodiscard]] std::uint32_t vendor() const noexcept { return vendor_; }

 private:
  struct Tpdo {
    std::size_t bytes = 0;
    int divider = 0;
    Time at = Time::min();
    std::uint64_t due = 0;  // number of the SYNC it comes with next
    bool protects = false;
    PdoGuard guard;
    std::uint64_t refused = 0;  // since `at`
  };
  [[nodiscard]] static std::size_t index_of(int number) noexcept {
    return static_cast<std::size_t>(number - 1);
  }
  bool take(const can::StampedFrame& frame, Time now) noexcept;
  bool receive_tpdo(const can::StampedFrame& frame) noexcept;
  bool on_error_control(const can::StampedFrame& frame) noexcept;
  /// Its last heartbeat says so, and it is not that one's bits that were turned over: the one before says it
  /// too, or no TPDO comes behind it, which only an operational node sends (CiA 301, 7.3.2.2).
  [[nodiscard]] bool left_operational(Time now) const noexcept;
  /// Due since the SYNC `since`, and no longer than `longest` SYNCs.
  [[nodiscard]] bool overdue(std::uint64_t since, std::uint64_t longest) const noexcept {
    return syncs_ >= since && syncs_ - since < longest;
  }

  NodeSettings settings_;
  SdoClient sdo_;
  SdoSequence configuration_{std::vector<SdoStep>{}};
  std::array<Tpdo, 4> tpdos_{};
  std::array<std::uint8_t, 4> rpdo_counts_{};        // of protected RPDOs
  std::array<std::uint8_t, 16> tpdo_of_function_{};  // by function code: 1..4, or 0

  std::uint64_t syncs_ = 0;
  std::uint64_t reset_at_ = 0, request_at_ = 0;  // SYNCs sent before it
  Time heartbeat_at_{};
  Time heard_at_ = Time::min();
  int frames_since_sync_ = 0;
  int odd_heartbeats_ = 0;  // in a row, of a state other than operational
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
