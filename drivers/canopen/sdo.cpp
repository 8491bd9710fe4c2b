#include "drivers/canopen/sdo.h"

namespace walkman::canopen {

std::string_view describe(SdoAbort code) noexcept {
  switch (code) {
    case SdoAbort::kToggle:
      return "toggle bit not alternated";
    case SdoAbort::kTimeout:
      return "SDO protocol timed out";
    case SdoAbort::kCommand:
      return "command specifier not valid or unknown";
    case SdoAbort::kBlockSize:
      return "invalid block size";
    case SdoAbort::kSequence:
      return "invalid sequence number";
    case SdoAbort::kCrc:
      return "CRC error";
    case SdoAbort::kMemory:
      return "out of memory";
    case SdoAbort::kAccess:
      return "unsupported access to an object";
    case SdoAbort::kWriteOnly:
      return "read of a write-only object";
    case SdoAbort::kReadOnly:
      return "write of a read-only object";
    case SdoAbort::kNoObject:
      return "object does not exist";
    case SdoAbort::kNotMappable:
      return "object cannot be mapped to a PDO";
    case SdoAbort::kPdoLength:
      return "mapping exceeds the PDO length";
    case SdoAbort::kParameter:
      return "general parameter incompatibility";
    case SdoAbort::kInternal:
      return "general internal incompatibility";
    case SdoAbort::kHardware:
      return "access failed due to a hardware error";
    case SdoAbort::kLengthMismatch:
      return "length of service parameter does not match";
    case SdoAbort::kTooLong:
      return "service parameter too long";
    case SdoAbort::kTooShort:
      return "service parameter too short";
    case SdoAbort::kNoSubIndex:
      return "sub-index does not exist";
    case SdoAbort::kValue:
      return "invalid value";
    case SdoAbort::kTooHigh:
      return "value too high";
    case SdoAbort::kTooLow:
      return "value too low";
    case SdoAbort::kMaxBelowMin:
      return "maximum is less than minimum";
    case SdoAbort::kResource:
      return "resource not available";
    case SdoAbort::kGeneral:
      return "general error";
    case SdoAbort::kStore:
      return "data cannot be stored";
    case SdoAbort::kLocalControl:
      return "refused because of local control";
    case SdoAbort::kDeviceState:
      return "refused in the present device state";
    case SdoAbort::kNoDictionary:
      return "no object dictionary";
    case SdoAbort::kNoData:
      return "no data available";
  }
  return "unknown abort code";
}

}  // namespace walkman::canopen
