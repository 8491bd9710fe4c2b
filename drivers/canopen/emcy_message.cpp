#include "drivers/canopen/emcy_message.h"

#include <cstring>

#include "drivers/canopen/little_endian.h"

namespace walkman::canopen {
namespace {

struct ErrorText {
  std::uint16_t code;
  std::uint16_t mask;  // 0xFFFF: only this code
  std::string_view text;
};

// Narrower masks come first.
constexpr ErrorText kTexts[] = {
    {0x0000, 0xFF00, "no error"},
    {0x8110, 0xFFFF, "CAN overrun"},
    {0x8120, 0xFFFF, "CAN error-passive"},
    {0x8130, 0xFFFF, "heartbeat of the master lost"},
    {0x8140, 0xFFFF, "recovered from bus-off"},
    {0x8150, 0xFFFF, "another node sends its CAN identifier"},
    {0x8210, 0xFFFF, "RPDO too short"},
    {0x8220, 0xFFFF, "RPDO too long"},
    {0x8230, 0xFFFF, "multiplexed PDO's destination not available"},
    {0x8240, 0xFFFF, "unexpected SYNC length"},
    {0x8250, 0xFFFF, "RPDO time-out"},
    {0x2100, 0xFF00, "current at the device's input"},
    {0x2200, 0xFF00, "current inside the device"},
    {0x2300, 0xFF00, "current at the device's output"},
    {0x3100, 0xFF00, "mains voltage"},
    {0x3200, 0xFF00, "voltage inside the device"},
    {0x3300, 0xFF00, "output voltage"},
    {0x4100, 0xFF00, "ambient temperature"},
    {0x4200, 0xFF00, "device temperature"},
    {0x6100, 0xFF00, "internal software"},
    {0x6200, 0xFF00, "user software"},
    {0x6300, 0xFF00, "data set"},
    {0x8100, 0xFF00, "communication"},
    {0x8200, 0xFF00, "protocol error"},
    {0xFF00, 0xFF00, ""},
    {0x1000, 0xF000, "generic error"},
    {0x2000, 0xF000, "current"},
    {0x3000, 0xF000, "voltage"},
    {0x4000, 0xF000, "temperature"},
    {0x5000, 0xF000, "device hardware"},
    {0x6000, 0xF000, "device software"},
    {0x7000, 0xF000, "additional modules"},
    {0x8000, 0xF000, "monitoring"},
    {0x9000, 0xF000, "external error"},
    {0xF000, 0xFF00, "additional functions"},
};

}  // namespace

std::optional<EmcyMessage> decode_emcy(const can::Frame& frame) noexcept {
  if (frame.length != 8) return std::nullopt;
  EmcyMessage message;
  message.code = get<std::uint16_t>(frame.data.data());
  message.error_register = frame.data[2];
  std::memcpy(message.manufacturer.data(), frame.data.data() + 3, message.manufacturer.size());
  return message;
}

std::string_view communication_error_text(std::uint16_t code) noexcept {
  for (const ErrorText& known : kTexts) {
    if ((code & known.mask) == known.code) return known.text;
  }
  return "unknown error code";
}

}  // namespace walkman::canopen
