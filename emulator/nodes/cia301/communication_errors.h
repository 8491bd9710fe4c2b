#pragma once

#include <cstdint>

/// EMCY codes of the communication layer (CiA 301, table 26).
namespace walkman::nodes::communication_error {

inline constexpr std::uint16_t kOverrun = 0x8110;       ///< objects lost: the transmit queue was full
inline constexpr std::uint16_t kErrorPassive = 0x8120;  ///< the CAN controller is error-passive
inline constexpr std::uint16_t kMasterLost = 0x8130;    ///< heartbeat or life guarding
inline constexpr std::uint16_t kBusOffOver = 0x8140;    ///< recovered from bus-off
inline constexpr std::uint16_t kPdoTooShort = 0x8210;   ///< RPDO not processed due to its length
inline constexpr std::uint16_t kPdoTooLong = 0x8220;    ///< RPDO longer than mapped
inline constexpr std::uint16_t kSyncLength = 0x8240;    ///< unexpected SYNC data length
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;   ///< RPDO deadline

}  // namespace walkman::nodes::communication_error
