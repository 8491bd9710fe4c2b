#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/emergency.h"
#include "drivers/canopen/nmt.h"
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

  /// Tells the node that NMT start was sent.
  void start(Time now) noexcept;

  /// Takes a frame with one of the node's transmit COB-IDs of the predefined connection set.
  /// False when it was of the wrong length, of an unknown kind or no plain data frame; it is then without
  /// effect.
  bool receive(const can::StampedFrame& frame, Time now) noexcept;

  /// Once a cycle after receiving: SDO time-outs and background requests.
  virtual void poll(Time now) noexcept;

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] SdoClient& sdo() noexcept { return sdo_; }
  [[nodiscard]] const SdoSequence& configuration() const noexcept { return configuration_; }
  [[nodiscard]] NmtState nmt_state() const noexcept { return nmt_state_; }

  /// Time since the last heartbeat (or the NMT start, whichever is later).
  [[nodiscard]] Time heartbeat_age(Time now) const noexcept;

  /// First emergency since `clear_events`, and how many came in all.
  [[nodiscard]] const std::optional<Emergency>& emergency() const noexcept { return emergency_; }
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  /// A request in operation that was refused or not answered.
  [[nodiscard]] bool request_failed() const noexcept { return request_failed_; }
  [[nodiscard]] ObjectAddress failed_address() const noexcept { return failed_address_; }
  [[nodiscard]] SdoAbort failed_code() const noexcept { return failed_code_; }
  /// Forgets the latched emergency, failed request and what derived classes latch.
  virtual void clear_events() noexcept;

 protected:
  RemoteNode(NodeSettings settings, std::vector<SdoStep> configuration);

  /// PDO `number` 1..4 arrived. False when its length is wrong.
  virtual bool on_tpdo(int number, const can::StampedFrame& frame) noexcept = 0;
  /// The node is about to be booted: forget all samples.
  virtual void on_begin_boot() noexcept = 0;
  void latch_request_failure() noexcept;

 private:
  bool on_error_control(const can::StampedFrame& frame) noexcept;

  NodeSettings settings_;
  SdoClient sdo_;
  SdoSequence configuration_;
  Stage stage_ = Stage::kAwaitingBootUp;
  bool boot_up_ = false;
  NmtState nmt_state_ = NmtState::kBootUp;
  Time heartbeat_at_{};
  std::optional<Emergency> emergency_;
  std::uint64_t emergencies_ = 0;
  bool request_failed_ = false;
  ObjectAddress failed_address_;
  SdoAbort failed_code_{};
};

/// First steps of every node's configuration: device type 1000h, vendor-ID 1018h:1.
[[nodiscard]] std::vector<SdoStep> identity_steps(std::uint32_t device_type);

/// Makes the node produce its heartbeat (1017h).
[[nodiscard]] SdoStep heartbeat_producer_step(const NodeSettings& settings);

/// `time` in milliseconds, rounded up.
[[nodiscard]] std::uint32_t milliseconds_of(Time time);

}  // namespace walkman::canopen
