#include "emulator/bus/error_message.h"

namespace walkman::bus {
namespace {

// Classes, in the identifier.
constexpr std::uint32_t kController = 0x004;
constexpr std::uint32_t kProtocol = 0x008;
constexpr std::uint32_t kNoAcknowledge = 0x020;
constexpr std::uint32_t kBusOff = 0x040;
constexpr std::uint32_t kBusError = 0x080;
constexpr std::uint32_t kRestarted = 0x100;

// data[1] of class "controller".
constexpr std::uint8_t kReceiveWarning = 0x04;
constexpr std::uint8_t kSendWarning = 0x08;
constexpr std::uint8_t kReceivePassive = 0x10;
constexpr std::uint8_t kSendPassive = 0x20;
constexpr std::uint8_t kActiveAgain = 0x40;

// data[2] of class "protocol violation".
constexpr std::uint8_t kBit = 0x01;
constexpr std::uint8_t kForm = 0x02;
constexpr std::uint8_t kStuff = 0x04;
constexpr std::uint8_t kNotDominant = 0x08;
constexpr std::uint8_t kNotRecessive = 0x10;
constexpr std::uint8_t kSending = 0x80;

can::Frame message(std::uint32_t classes) noexcept {
  can::Frame frame;
  frame.error = true;
  frame.id = classes;
  frame.length = 8;
  return frame;
}

void put_counters(can::Frame& frame, const FaultConfinement& controller) noexcept {
  frame.data[6] = static_cast<std::uint8_t>(std::min(controller.transmit_errors(), 255));
  frame.data[7] = static_cast<std::uint8_t>(std::min(controller.receive_errors(), 255));
}

std::uint8_t violation(const BusError& error) noexcept {
  switch (error.kind) {
    case BusError::Kind::kBit:
      if (!error.sending) return kBit;
      return error.level == 0 ? kNotRecessive : kNotDominant;
    case BusError::Kind::kStuff:
      return kStuff;
    case BusError::Kind::kForm:
      return kForm;
    case BusError::Kind::kNoAcknowledge:
      break;
  }
  return 0;
}

}  // namespace

can::Frame bus_error_message(const BusError& error, const FaultConfinement& controller) noexcept {
  can::Frame frame = message(kProtocol | kBusError);
  if (error.kind == BusError::Kind::kNoAcknowledge) frame.id |= kNoAcknowledge;
  frame.data[2] = static_cast<std::uint8_t>(violation(error) | (error.sending ? kSending : 0U));
  frame.data[3] = static_cast<std::uint8_t>(error.field);
  put_counters(frame, controller);
  return frame;
}

can::Frame state_message(const FaultConfinement& controller) noexcept {
  if (controller.bus_off()) return message(kBusOff);
  can::Frame frame = message(kController);
  const int send = controller.transmit_errors();
  const int receive = controller.receive_errors();
  std::uint8_t state = 0;
  switch (controller.state()) {
    case can::LinkState::kWarning:
      state = static_cast<std::uint8_t>((send >= receive ? kSendWarning : 0U) |
                                        (receive >= send ? kReceiveWarning : 0U));
      break;
    case can::LinkState::kPassive:
      state = static_cast<std::uint8_t>((send >= receive ? kSendPassive : 0U) |
                                        (receive >= send ? kReceivePassive : 0U));
      break;
    default:
      state = kActiveAgain;
  }
  frame.data[1] = state;
  put_counters(frame, controller);
  return frame;
}

can::Frame restart_message() noexcept { return message(kRestarted); }

}  // namespace walkman::bus
