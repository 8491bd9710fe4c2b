#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/canopen/master.h"
#include "drivers/canopen/remote_node.h"
#include "drivers/robot/fault.h"
#include "drivers/robot/robot_options.h"

namespace walkman::robot {

/// One bus of the robot: its master, the devices on it, and the judgement of all of them together. A device
/// is blamed only for what the bus as a whole does not explain. After set-up, only reporting a warning
/// allocates.
class RobotBus {
 public:
  /// `own_load`: largest share of the bus time that the bus's own traffic needs (`BusLoad::with_events`).
  /// `interface` must outlive this.
  RobotBus(can::Interface& interface, const can::BitRates& rates, double own_load,
           const RobotOptions& options);

  void add(std::unique_ptr<canopen::RemoteNode> device);

  [[nodiscard]] canopen::Master& master() noexcept { return master_; }
  [[nodiscard]] const canopen::Master& master() const noexcept { return master_; }
  /// In table order.
  [[nodiscard]] std::span<const std::unique_ptr<canopen::RemoteNode>> devices() const noexcept {
    return devices_;
  }
  /// Name of the interface.
  [[nodiscard]] std::string name() const { return std::string(master_.interface().name()); }

  /// Processes received frames.
  void receive(Time now) noexcept;
  /// Sends the RPDOs of the devices whose turn it is after `syncs` SYNCs.
  void send_rpdos(std::uint64_t syncs) noexcept;
  /// Whether a device's PDOs go with the next SYNC after `syncs` of them.
  [[nodiscard]] static bool has_turn(const canopen::RemoteNode& device, std::uint64_t syncs) noexcept {
    return syncs % static_cast<std::uint64_t>(device.sync_divider()) == 0;
  }

  /// First fault of the link; a fault that is only a symptom is replaced by its cause.
  [[nodiscard]] std::optional<FaultRecord> judge_link(Time now) const noexcept;
  /// First fault of the devices; symptoms are replaced by their cause here, too.
  [[nodiscard]] std::optional<FaultRecord> judge_devices(Time now) const noexcept;
  /// Set if several devices have sent the same emergency about a voltage they do not generate themselves.
  [[nodiscard]] std::optional<canopen::cause::SupplyAtFault> of_supply(const canopen::cause::Emcy& emergency,
                                                                       Time now) const noexcept;
  /// The link first, then the devices.
  [[nodiscard]] std::optional<FaultRecord> judge(Time now) const noexcept;
  /// Time since any of the devices was last heard.
  [[nodiscard]] Time quiet_for(Time now) const noexcept;
  /// Value of `quiet_for` from which the bus counts as silent: no device skips that many of its turns.
  [[nodiscard]] Time quiet_limit() const noexcept { return cycle_ * (stale_after_cycles_ - 1); }
  /// Set if foreign frames leave no room for the bus's own traffic.
  [[nodiscard]] std::optional<canopen::cause::BusFlooded> flood() const noexcept;

  /// Appends to `list` the warnings (not faults) that have not been reported yet, one sentence each.
  void tell_new_warnings(std::vector<std::string>& list);

  // Progress of the bus in a boot or recovery; maintained by `Boot`.
  bool commanded = false;      ///< the NMT command of the present phase has been sent
  bool reset = false;          ///< being booted from NMT reset in the boot under way
  bool power_up = false;       ///< its drives are being powered up in the boot under way
  bool link_was_lost = false;  ///< since the last boot of this bus

 private:
  [[nodiscard]] FaultRecord record(const canopen::FaultCause& cause, Time now) const noexcept;
  [[nodiscard]] FaultRecord explained(const FaultRecord& symptom, Time now) const noexcept;
  [[nodiscard]] bool several_overdue(Time now) const noexcept;
  [[nodiscard]] std::string meaning_of(std::uint32_t cob_id) const;

  canopen::Master master_;
  std::vector<std::unique_ptr<canopen::RemoteNode>> devices_;
  double own_load_;
  Time cycle_;
  int stale_after_cycles_;

  // Warnings already reported.
  bool told_warning_ = false, told_passive_ = false, told_flood_ = false;
  std::size_t told_foreign_ = 0;    // number of the master's foreign identifiers
  std::vector<bool> told_devices_;  // table order
};

}  // namespace walkman::robot
