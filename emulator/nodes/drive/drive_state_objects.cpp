// State, modes, and inputs and outputs of a drive: 6007h, 603Fh-6061h, 60FDh, 60FEh, 6402h, 6502h.

#include "drivers/canopen/objects.h"
#include "drivers/cia402/words.h"
#include "emulator/nodes/cia301/choice.h"
#include "emulator/nodes/drive/drive_objects.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr auto kRo = Access::kReadOnly;
constexpr auto kRw = Access::kReadWrite;
constexpr auto kMap = Mappable::kYes;

// 6502h: pp, pv, tq, hm, ip, csp, csv, cst, and the manufacturer's impedance mode.
constexpr std::uint32_t kSupportedModes =
    1U << 0U | 1U << 2U | 1U << 3U | 1U << 5U | 1U << 6U | 1U << 7U | 1U << 8U | 1U << 9U | 1U << 16U;

constexpr std::uint16_t kSinusoidalBrushless = 10;  // 6402h

}  // namespace

void DriveObjects::add_state_objects() {
  ObjectDictionary& d = dictionary_;
  abort_connection_option = d.add<std::int16_t>(object::kAbortConnection, 0, kRw, 3);
  allow<std::int16_t>(abort_connection_option, {0, 1, 2, 3});
  error_code = d.add<std::uint16_t>(object::kErrorCode, 0, kRo, 0, kMap);
  controlword = d.add<std::uint16_t>(object::kControlword, 0, kRw, 0, kMap);
  statusword = d.add<std::uint16_t>(object::kStatusword, 0, kRo, 0, kMap);
  quick_stop_option = d.add<std::int16_t>(0x605A, 0, kRw, 2);
  allow<std::int16_t>(quick_stop_option, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  shutdown_option = d.add<std::int16_t>(0x605B, 0, kRw, 0);
  allow<std::int16_t>(shutdown_option, {0, 1});
  disable_option = d.add<std::int16_t>(0x605C, 0, kRw, 1);
  allow<std::int16_t>(disable_option, {0, 1});
  halt_option = d.add<std::int16_t>(0x605D, 0, kRw, 1);
  allow<std::int16_t>(halt_option, {1, 2, 3, 4});
  fault_reaction_option = d.add<std::int16_t>(0x605E, 0, kRw, 2);
  allow<std::int16_t>(fault_reaction_option, {0, 1, 2, 3, 4});
  constexpr auto kFactoryMode = static_cast<std::int8_t>(cia402::Mode::kCyclicSynchronousPosition);
  mode = d.add<std::int8_t>(object::kMode, 0, kRw, kFactoryMode, kMap);
  mode_display = d.add<std::int8_t>(object::kModeDisplay, 0, kRo, kFactoryMode, kMap);
  supply_voltage = measurement<std::uint32_t>(0x6079, 0);
  digital_inputs = measurement<std::uint32_t>(0x60FD, 0);
  add_count(0x60FE, 2);
  digital_outputs = d.add<std::uint32_t>(0x60FE, 1, kRw, 0, kMap);
  output_mask = d.add<std::uint32_t>(0x60FE, 2, kRw, 0, kMap);
  d.add<std::uint16_t>(0x6402, 0, kRo, kSinusoidalBrushless);
  d.add<std::uint32_t>(object::kSupportedModes, 0, kRo, kSupportedModes);
}

}  // namespace walkman::nodes
