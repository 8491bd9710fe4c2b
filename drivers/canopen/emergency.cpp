#include "drivers/canopen/emergency.h"

#include "drivers/canopen/little_endian.h"

namespace walkman::canopen {

std::optional<Emergency> decode_emergency(const can::Frame& frame) noexcept {
  if (frame.length != 8) return std::nullopt;
  Emergency emergency;
  emergency.code = get<std::uint16_t>(frame.data.data());
  emergency.error_register = frame.data[2];
  std::memcpy(emergency.manufacturer.data(), frame.data.data() + 3, emergency.manufacturer.size());
  return emergency;
}

std::string_view describe_error_code(std::uint16_t code) noexcept {
  switch (code) {
    case 0x0000:
      return "no error";
    case 0x2220:
      return "continuous over-current inside the device";
    case 0x2310:
      return "continuous over-current at the output";
    case 0x2320:
      return "short circuit or earth leakage at the output";
    case 0x2350:
      return "thermal overload (i2t)";
    case 0x3210:
      return "DC link over-voltage";
    case 0x3220:
      return "DC link under-voltage";
    case 0x4210:
      return "drive over-temperature";
    case 0x4310:
      return "motor over-temperature";
    case 0x5112:
      return "logic supply low";
    case 0x5530:
      return "non-volatile memory";
    case 0x6010:
      return "software reset (watchdog)";
    case 0x6320:
      return "parameter error";
    case 0x7121:
      return "motor blocked";
    case 0x7122:
      return "motor error or commutation";
    case 0x7305:
      return "motor-side encoder failure";
    case 0x7306:
      return "link-side encoder failure";
    case 0x8110:
      return "CAN overrun";
    case 0x8120:
      return "CAN error-passive";
    case 0x8130:
      return "heartbeat of the master lost";
    case 0x8140:
      return "recovered from bus-off";
    case 0x8210:
      return "RPDO too short";
    case 0x8220:
      return "RPDO too long";
    case 0x8240:
      return "unexpected SYNC length";
    case 0x8250:
      return "RPDO time-out";
    case 0x8311:
      return "torque limit exceeded";
    case 0x8611:
      return "following error";
    case 0x8612:
      return "position reference limit";
    case 0xFF01:
      return "force/torque over-range";
    case 0xFF02:
      return "force/torque sensor fault";
    default:
      break;
  }
  switch (code >> 12) {
    case 0x1:
      return "generic error";
    case 0x2:
      return "current";
    case 0x3:
      return "voltage";
    case 0x4:
      return "temperature";
    case 0x5:
      return "device hardware";
    case 0x6:
      return "device software";
    case 0x7:
      return "additional modules";
    case 0x8:
      return "monitoring";
    case 0x9:
      return "external error";
    case 0xF:
      return "device specific";
    default:
      return "unknown error code";
  }
}

}  // namespace walkman::canopen
