#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/canopen/pdo_settings.h"

namespace walkman::cia402 {

/// What a field of a drive's PDO is to the driver.
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
  kKept,            ///< of no use here: what the drive had at boot is sent back
};

/// One value and its place in a PDO's bytes.
struct DriveField {
  DriveValue value{};
  std::uint8_t offset = 0;  ///< of its first byte in the PDO
  std::uint8_t bytes = 0;   ///< its length
  std::uint8_t kept = 0;    ///< of a `kKept`: its place in `DriveMapping::kept`
};

/// Where a drive's values lie in its PDOs, worked out once from the mapping so that the cycle only copies
/// bytes.
class DriveMapping {
 public:
  /// Throws std::runtime_error with one sentence: the mapping lacks what the driver needs (6040h and 607Ah;
  /// 6041h, 6064h and 6077h in TPDOs that come with SYNC), an object has another size than CiA 402 gives it,
  /// or the PDOs that go with SYNC go with different ones.
  explicit DriveMapping(const canopen::DevicePdos& pdos);

  /// Fields of TPDO `number` 1..4.
  [[nodiscard]] std::span<const DriveField> transmit(int number) const noexcept {
    return transmit_[static_cast<std::size_t>(number - 1)];
  }
  /// Fields of RPDO `number` 1..4; empty for one that is off.
  [[nodiscard]] std::span<const DriveField> receive(int number) const noexcept {
    return receive_[static_cast<std::size_t>(number - 1)];
  }
  /// Some PDO carries the value.
  [[nodiscard]] bool has(DriveValue value) const noexcept {
    return (present_ >> static_cast<unsigned>(value) & 1U) != 0;
  }
  /// The PDOs travel with every n-th SYNC.
  [[nodiscard]] int sync_divider() const noexcept { return sync_divider_; }
  /// Mapped objects the driver has no value for.
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

/// A drive's factory mapping, layout A of docs/protocol.md: what it has after NMT reset when nobody writes
/// anything to it. `sync_divider`: the synchronous PDOs travel with every n-th SYNC.
[[nodiscard]] canopen::DevicePdos factory_drive_pdos(std::uint8_t sync_divider);

}  // namespace walkman::cia402
