#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/emergency.h"
#include "drivers/canopen/identity.h"
#include "drivers/canopen/nmt.h"
#include "drivers/canopen/pdo_settings.h"
#include "drivers/canopen/sdo_client.h"
#include "drivers/canopen/sdo_sequence.h"

namespace walkman::canopen {

/// Node-ID under which the master of a bus produces its own heartbeat.
inline constexpr std::uint8_t kMasterNodeId = 127;

/// How long a request over SDO may take. CiA 301 leaves it to the application; servers answer within a cycle.
inline constexpr Time kSdoTimeout = std::chrono::milliseconds(200);

/// Where a node sits and how it is supervised.
struct NodeSettings {
  std::uint8_t node_id = 0;
  std::string name;       ///< URDF joint or frame
  std::string interface;  ///< name of the bus in texts
  std::string noun;       ///< what it is in texts, e.g. "drive"
  Time cycle = std::chrono::milliseconds(5);
  Time heartbeat_producer = std::chrono::milliseconds(100);  ///< 1017h of the node
  Time heartbeat_timeout = std::chrono::milliseconds(250);  ///< 1016h of the node, for the master's heartbeat
  ExpectedIdentity identity;
  DevicePdos pdos;
  bool fd = false;                 ///< its PDOs may come in CAN FD frames
  std::uint8_t sync_overflow = 0;  ///< 1019h: 2 to 240, SYNC has a counter; 0: it has none
};

/// A node as its master sees it: SDO channel, configuration, boot-up, heartbeat, EMCY. What its PDOs mean is
/// the business of the classes derived from it.
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
  /// Tells the node that SYNC was sent, and that its `sdo().pending()` was.
  void sync_sent() noexcept { ++syncs_; }
  void request_sent() noexcept;

  /// Takes a frame with one of the node's transmit COB-IDs of the predefined connection set.
  /// False when it was of the wrong length, of an unknown kind or no plain data frame; it is then without
  /// effect.
  bool receive(const can::StampedFrame& frame, Time now) noexcept;

  /// Once a cycle after receiving: SDO time-outs and background requests.
  virtual void poll(Time now) noexcept;

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] SdoClient& sdo() noexcept { return sdo_; }
  [[nodiscard]] const SdoSequence& configuration() const noexcept { return configuration_; }
  /// As the node last told it; a PDO after NMT start tells it is operational.
  [[nodiscard]] NmtState nmt_state() const noexcept { return nmt_state_; }

  /// TPDO `number` 1..4 comes with every n-th SYNC; 0 when it is off or not of that kind.
  [[nodiscard]] int sync_divider(int number) const noexcept;
  /// Stamp of the newest TPDO `number`; `Time::min()` before the first since the boot began.
  [[nodiscard]] Time tpdo_at(int number) const noexcept { return tpdos_[index_of(number)].at; }
  /// Every TPDO that comes with SYNC has come at least once.
  [[nodiscard]] bool has_cyclic_data() const noexcept;
  /// Stamp of the oldest of the newest TPDOs that come with SYNC; `Time::min()` when one is missing.
  [[nodiscard]] Time cyclic_data_at() const noexcept;

  /// Nothing is outstanding that the SYNCs sent so far must have brought about: the boot-up after an NMT
  /// reset, the answer to an SDO request sent before the last SYNC, the TPDOs due with it. What has failed to
  /// come several times over is not waited for any more.
  [[nodiscard]] bool settled() const noexcept;

  /// Time since the last heartbeat (or the NMT start, whichever is later).
  [[nodiscard]] Time heartbeat_age(Time now) const noexcept;

  /// First emergency since `clear_events`, and how many came in all.
  [[nodiscard]] const std::optional<Emergency>& emergency() const noexcept { return emergency_; }
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  /// Code of the newest emergency, 0000h when the node reported the end of all errors.
  [[nodiscard]] std::uint16_t present_error() const noexcept { return present_error_; }
  /// A request in operation that was refused or not answered.
  [[nodiscard]] bool request_failed() const noexcept { return request_failed_; }
  [[nodiscard]] ObjectAddress failed_address() const noexcept { return failed_address_; }
  [[nodiscard]] SdoAbort failed_code() const noexcept { return failed_code_; }
  /// Forgets the latched emergency, failed request and what derived classes latch.
  virtual void clear_events() noexcept;

 protected:
  explicit RemoteNode(NodeSettings settings);

  /// Before anything else; what `configure` runs through.
  void set_configuration(std::vector<SdoStep> steps) { configuration_ = SdoSequence(std::move(steps)); }

  /// PDO `number` 1..4 arrived, with at least the bytes of its mapping.
  virtual void on_tpdo(int number, const can::StampedFrame& frame) noexcept = 0;
  /// The node is about to be booted: forget all samples.
  virtual void on_begin_boot() noexcept = 0;
  void latch_request_failure() noexcept;

 private:
  struct Tpdo {
    std::size_t bytes = 0;
    int divider = 0;
    Time at = Time::min();
    std::uint64_t due = 0;  // number of the SYNC it comes with next
  };
  [[nodiscard]] static std::size_t index_of(int number) noexcept {
    return static_cast<std::size_t>(number - 1);
  }
  bool receive_tpdo(const can::StampedFrame& frame) noexcept;
  bool on_error_control(const can::StampedFrame& frame) noexcept;
  [[nodiscard]] bool overdue(std::uint64_t since, std::uint64_t patience) const noexcept {
    return syncs_ >= since && syncs_ - since < patience;
  }

  NodeSettings settings_;
  SdoClient sdo_;
  SdoSequence configuration_{std::vector<SdoStep>{}};
  std::array<Tpdo, 4> tpdos_{};
  std::array<std::uint8_t, 16> tpdo_of_function_{};  // by function code: 1..4, or 0

  std::uint64_t syncs_ = 0;
  std::uint64_t reset_at_ = 0, request_at_ = 0;  // SYNCs sent before it
  Time heartbeat_at_{};
  std::uint64_t emergencies_ = 0;
  std::optional<Emergency> emergency_;
  std::uint16_t present_error_ = 0;

  SdoAbort failed_code_{};
  ObjectAddress failed_address_;
  Stage stage_ = Stage::kAwaitingBootUp;
  NmtState nmt_state_ = NmtState::kBootUp;
  bool boot_up_ = false;
  bool reset_sent_ = false;
  bool operational_seen_ = false;
  bool request_failed_ = false;
};

/// First steps of a node's configuration: `settings.identity`, with `device_type` where it has none.
[[nodiscard]] std::vector<SdoStep> identity_steps_of(const NodeSettings& settings, std::uint32_t device_type);

/// Heartbeat producer and consumer (1017h; 1016h:1, the master's), and the SYNC counter where there is one.
[[nodiscard]] std::vector<SdoStep> supervision_steps(const NodeSettings& settings);

/// `time` in milliseconds, rounded up.
[[nodiscard]] std::uint32_t milliseconds_of(Time time);

}  // namespace walkman::canopen
