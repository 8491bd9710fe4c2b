#include "drivers/can/error_report.h"

#include <linux/can/error.h>

namespace walkman::can {
namespace {

std::uint8_t controller_bits(const Frame& frame) noexcept {
  return (frame.id & CAN_ERR_CRTL) != 0 && frame.length >= 2 ? frame.data[1] : std::uint8_t{0};
}

}  // namespace

LinkState link_after(const Frame& error_frame, LinkState before) noexcept {
  if ((error_frame.id & CAN_ERR_BUSOFF) != 0) return LinkState::kBusOff;
  if ((error_frame.id & CAN_ERR_RESTARTED) != 0) return LinkState::kActive;
  const unsigned bits = controller_bits(error_frame);
  if ((bits & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) return LinkState::kPassive;
  if ((bits & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) return LinkState::kWarning;
  if ((bits & CAN_ERR_CRTL_ACTIVE) != 0) return LinkState::kActive;
  return before;
}

bool tells_receive_overflow(const Frame& error_frame) noexcept {
  return (controller_bits(error_frame) & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
}

std::string_view name_of(LinkState state) noexcept {
  switch (state) {
    case LinkState::kActive:
      return "error-active";
    case LinkState::kWarning:
      return "error-warning";
    case LinkState::kPassive:
      return "error-passive";
    case LinkState::kBusOff:
      return "bus-off";
    case LinkState::kDown:
      return "down";
  }
  return "unknown";
}

}  // namespace walkman::can
