#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/sdo_sequence.h"

namespace walkman::canopen {

/// RPDO and TPDO as the device sees them.
enum class PdoDirection { kReceive, kTransmit };

/// One entry of a PDO mapping (16xxh, 1Axxh).
struct MappingEntry {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t bits = 0;
  friend bool operator==(const MappingEntry&, const MappingEntry&) = default;

  /// Value of this entry in the mapping record.
  [[nodiscard]] constexpr std::uint32_t entry() const noexcept {
    return std::uint32_t{index} << 16U | std::uint32_t{sub} << 8U | bits;
  }
  /// Whether it is one of the types 0001h..0007h: bytes without a meaning (CiA 301, 7.4.7.1).
  [[nodiscard]] constexpr bool dummy() const noexcept { return index <= 0x0007; }
};

/// Desired settings of a PDO: communication record (14xxh, 18xxh) and mapping.
struct PdoSettings {
  bool enabled = false;
  std::uint32_t cob_id_base = 0;               ///< COB-ID minus the node-ID
  std::uint8_t type = 255;                     ///< transmission type
  std::optional<std::uint16_t> inhibit_100us;  ///< sub-index 3, x 100 us; nullopt: the device's own
  std::optional<std::uint16_t> event_ms;       ///< sub-index 5, ms; nullopt: the device's own
  std::vector<MappingEntry> mapping{};
  friend bool operator==(const PdoSettings&, const PdoSettings&) = default;

  /// Length of its frames: sum of the mapped objects, without the padding of CAN FD.
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Whether its last object is the protection, 2052h.
  [[nodiscard]] bool protects() const noexcept;
  /// Whether it is sent with SYNC, every `type`-th one.
  [[nodiscard]] bool cyclic() const noexcept { return enabled && type >= 1 && type <= 240; }
};

/// The four RPDOs and TPDOs of a device; number n is element n - 1.
struct DevicePdos {
  std::array<PdoSettings, 4> receive{}, transmit{};
  bool write_receive = false;  ///< write 14xxh and 16xxh at boot; otherwise the device already has them
  bool write_transmit = false;
  friend bool operator==(const DevicePdos&, const DevicePdos&) = default;
};

/// All eight PDOs disabled, at their predefined COB-IDs (CiA 301, 7.3.5): the basis of a device's factory
/// mapping.
[[nodiscard]] DevicePdos predefined_pdos();

/// Enables a PDO with a transmission type and a mapping.
void enable(PdoSettings& pdo, std::uint8_t type, std::vector<MappingEntry> mapping);

/// Steps that configure PDO `number` 1..4 of a node according to `settings`, in the standard's order (CiA
/// 301, 7.5.2.36: invalidate, sub 0 := 0, entries, sub 0 := n, type and times, validate), and then read
/// everything back and compare. A PDO that is not enabled is only made invalid.
[[nodiscard]] std::vector<SdoStep> pdo_steps(PdoDirection direction, int number, const PdoSettings& settings,
                                             std::uint8_t node_id);

/// `pdo_steps` for every PDO that is to be written.
[[nodiscard]] std::vector<SdoStep> pdo_steps(const DevicePdos& pdos, std::uint8_t node_id);

/// "6041h:0".
[[nodiscard]] std::string name_of(const MappingEntry& object);

}  // namespace walkman::canopen
