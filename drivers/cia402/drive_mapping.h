#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/canopen/pdo_settings.h"

namespace walkman::cia402 {

/// Meaning of a field of a drive's PDO to the driver.
enum class DriveValue : std::uint8_t {
  // TPDO
  kStatusword,    ///< 6041h
  kModeDisplay,   ///< 6061h
  kTorque,        ///< 6077h
  kPosition,      ///< 6064h
  kVelocity,      ///< 606Ch
  kErrorCode,     ///< 603Fh
  kTemperature,   ///< 2031h:1
  kCycleCounter,  ///< 2050h:1
  // RPDO
  kControlword,     ///< 6040h
  kMode,            ///< 6060h
  kTargetTorque,    ///< 6071h
  kTargetPosition,  ///< 607Ah
  kTargetVelocity,  ///< 60FFh
  kTorqueOffset,    ///< 60B2h
  kMaxTorque,       ///< 6072h
  kKept,            ///< not used here: the value the drive had at boot is sent back
};

/// One value and its place in a PDO's bytes.
struct DriveField {
  DriveValue value{};
  std::uint8_t offset = 0;  ///< of its first byte in the PDO
  std::uint8_t bytes = 0;   ///< its length
  std::uint8_t kept = 0;    ///< for `kKept`: its index in `DriveMapping::kept`
};

/// Locations of a drive's values in its PDOs, computed once from the mapping so that the cycle only copies
/// bytes.
class DriveMapping {
 public:
  /// Throws std::runtime_error (one sentence) if the mapping lacks what the driver needs (6040h and 607Ah;
  /// 6041h, 6064h and 6077h in synchronous TPDOs), an object's size differs from CiA 402, or the synchronous
  /// PDOs are not all sent with the same SYNCs.
  explicit DriveMapping(const canopen::DevicePdos& pdos);

  /// Fields of TPDO `number` 1..4.
  [[nodiscard]] std::span<const DriveField> transmit(int number) const noexcept {
    return transmit_[static_cast<std::size_t>(number - 1)];
  }
  /// Fields of RPDO `number` 1..4; empty if it is disabled.
  [[nodiscard]] std::span<const DriveField> receive(int number) const noexcept {
    return receive_[static_cast<std::size_t>(number - 1)];
  }
  /// Whether any PDO carries the value.
  [[nodiscard]] bool has(DriveValue value) const noexcept {
    return (present_ >> static_cast<unsigned>(value) & 1U) != 0;
  }
  /// n if the PDOs are sent with every n-th SYNC.
  [[nodiscard]] int sync_divider() const noexcept { return sync_divider_; }
  /// Mapped objects for which the driver has no value.
  [[nodiscard]] const std::vector<canopen::MappingEntry>& kept() const noexcept { return kept_; }

 private:
  void take(canopen::PdoDirection direction, const canopen::PdoSettings& settings,
            std::vector<DriveField>& fields);
  void check_dividers(const canopen::DevicePdos& pdos);
  void check_presence(const canopen::DevicePdos& pdos) const;

  std::array<std::vector<DriveField>, 4> transmit_, receive_;
  std::vector<canopen::MappingEntry> kept_;
  std::uint32_t present_ = 0;
  int sync_divider_ = 1;
};

/// A drive's factory mapping, layout A of docs/protocol.md: the one it has after NMT reset if nothing is
/// written to it. `sync_divider` n: the synchronous PDOs are sent with every n-th SYNC.
[[nodiscard]] canopen::DevicePdos factory_drive_pdos(std::uint8_t sync_divider);

}  // namespace walkman::cia402
