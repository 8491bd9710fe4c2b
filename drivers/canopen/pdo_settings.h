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

  /// As the mapping record holds it.
  [[nodiscard]] constexpr std::uint32_t entry() const noexcept {
    return std::uint32_t{index} << 16U | std::uint32_t{sub} << 8U | bits;
  }
  /// One of the types 0001h..0007h: bytes without a meaning (CiA 301, 7.4.7.1).
  [[nodiscard]] constexpr bool dummy() const noexcept { return index <= 0x0007; }
};

/// What a PDO shall be: communication record (14xxh, 18xxh) and mapping.
struct PdoSettings {
  bool enabled = false;
  std::uint32_t cob_id_base = 0;               ///< COB-ID less the node-ID
  std::uint8_t type = 255;                     ///< transmission type
  std::optional<std::uint16_t> inhibit_100us;  ///< sub-index 3, x 100 us; nothing: the device's own
  std::optional<std::uint16_t> event_ms;       ///< sub-index 5, ms; nothing: the device's own
  std::vector<MappingEntry> mapping{};
  friend bool operator==(const PdoSettings&, const PdoSettings&) = default;

  /// Length of its frames: what the mapping adds up to, without the padding of CAN FD.
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Its last object is the protection, 2052h.
  [[nodiscard]] bool protects() const noexcept;
  /// Travels with SYNC, every `type`-th one.
  [[nodiscard]] bool cyclic() const noexcept { return enabled && type >= 1 && type <= 240; }
};

/// The four RPDOs and TPDOs of a device; number n is element n - 1.
struct DevicePdos {
  std::array<PdoSettings, 4> receive{}, transmit{};
  bool write_receive = false;  ///< write 14xxh and 16xxh at boot; else the device has them so already
  bool write_transmit = false;
  friend bool operator==(const DevicePdos&, const DevicePdos&) = default;
};

/// All eight PDOs off, at their predefined COB-IDs (CiA 301, 7.3.5): where a device's factory mapping begins.
[[nodiscard]] DevicePdos predefined_pdos();

/// Turns a PDO on with a transmission type and a mapping.
void enable(PdoSettings& pdo, std::uint8_t type, std::vector<MappingEntry> mapping);

/// The steps that make PDO `number` 1..4 of a node what `settings` say, in the standard's order (CiA 301,
/// 7.5.2.36: invalidate, sub 0 := 0, entries, sub 0 := n, type and times, validate), and then read it all
/// back and compare. A PDO that is not enabled is made invalid only.
[[nodiscard]] std::vector<SdoStep> pdo_steps(PdoDirection direction, int number, const PdoSettings& settings,
                                             std::uint8_t node_id);

/// `pdo_steps` of every PDO that is to be written.
[[nodiscard]] std::vector<SdoStep> pdo_steps(const DevicePdos& pdos, std::uint8_t node_id);

/// "6041h:0".
[[nodiscard]] std::string name_of(const MappingEntry& object);

}  // namespace walkman::canopen
