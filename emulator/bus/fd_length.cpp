// The length of CAN FD frames with bit-rate switch. Their CRC has its stuff bits at fixed places, so that its
// value does not matter for the length.

#include <array>

#include "emulator/bus/bit_stuffing.h"
#include "emulator/bus/frame_length.h"

namespace walkman::bus {
namespace {

constexpr std::array<std::uint8_t, 16> kLengths = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

constexpr unsigned kLongestShort = 16;       // bytes that CRC-17 guards
constexpr int kShortCheck = 4 + 17 + 6 + 1;  // stuff count, CRC, fixed stuff bits, delimiter
constexpr int kLongCheck = 4 + 21 + 7 + 1;
constexpr int kStatusAndLength = 1 + 4;  // ESI, DLC

}  // namespace

unsigned fd_length_code(unsigned length) noexcept {
  unsigned code = 0;
  while (code < kLengths.size() - 1 && kLengths[code] < length) ++code;
  return code;
}

unsigned fd_payload_length(unsigned code) noexcept { return kLengths[code & 0xFU]; }

WireLength wire_length(const can::Frame& frame, bool error_passive) noexcept {
  if (!frame.fd) return {frame_bits(frame), 0};
  const unsigned code = fd_length_code(frame.length);
  const unsigned length = fd_payload_length(code);

  // Up to BRS, at the nominal rate: SOF, identifier, RRS 0, IDE 0, FDF 1, res 0, BRS 1, or with a long
  // identifier SOF, base identifier, SRR 1, IDE 1, extension, RRS 0, FDF 1, res 0, BRS 1.
  const int width = frame.extended ? 1 + 11 + 2 + 18 + 4 : 1 + 11 + 5;
  const std::uint64_t base = (frame.id >> 18U) << 2U | 0b11U;
  const std::uint64_t header = frame.extended ? (base << 18U | (frame.id & 0x3FFFFU)) << 4U | 0b0101U
                                              : static_cast<std::uint64_t>(frame.id) << 5U | 0b00101U;
  StuffCounter stuffing;
  for (int i = width - 1; i >= 0; --i) stuffing.append_bit(static_cast<unsigned>(header >> i) & 1U);
  const int nominal_stuff = stuffing.inserted();

  stuffing.append_bit(error_passive ? 1 : 0);
  for (int i = 3; i >= 0; --i) stuffing.append_bit((code >> i) & 1U);
  for (unsigned i = 0; i < length; ++i) stuffing.append_byte(frame.data[i]);
  // Five equal bits at the end need no stuff bit: the first fixed one follows.
  const int data_stuff = stuffing.inserted() - nominal_stuff;

  return {width + nominal_stuff + kAckAndEndBits + kIntermissionBits,
          kStatusAndLength + 8 * static_cast<int>(length) + data_stuff +
              (length <= kLongestShort ? kShortCheck : kLongCheck)};
}

}  // namespace walkman::bus
