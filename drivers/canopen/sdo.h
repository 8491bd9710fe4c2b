#pragma once

#include <cstdint>
#include <string_view>

namespace walkman::canopen {

/// Address of an entry of an object dictionary.
struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

/// SDO abort codes (CiA 301, table 22).
enum class SdoAbort : std::uint32_t {
  kToggle = 0x05030000,
  kTimeout = 0x05040000,
  kCommand = 0x05040001,
  kBlockSize = 0x05040002,
  kSequence = 0x05040003,
  kCrc = 0x05040004,
  kMemory = 0x05040005,
  kAccess = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kPdoLength = 0x06040042,
  kParameter = 0x06040043,
  kInternal = 0x06040047,
  kHardware = 0x06060000,
  kLengthMismatch = 0x06070010,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubIndex = 0x06090011,
  kValue = 0x06090030,
  kTooHigh = 0x06090031,
  kTooLow = 0x06090032,
  kMaxBelowMin = 0x06090036,
  kResource = 0x060A0023,
  kGeneral = 0x08000000,
  kStore = 0x08000020,
  kLocalControl = 0x08000021,
  kDeviceState = 0x08000022,
  kNoDictionary = 0x08000023,
  kNoData = 0x08000024,
};

/// The standard's wording, shortened; "unknown abort code" for others.
[[nodiscard]] std::string_view describe(SdoAbort code) noexcept;

}  // namespace walkman::canopen
