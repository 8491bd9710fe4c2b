#include "emulator/bus/frame_length.h"

#include <cassert>

#include "emulator/bus/wire_coding.h"

namespace walkman::bus {
namespace {

/// CRC-15 and stuff bits over the same bits.
class StuffedRegion {
 public:
  /// Appends the lowest `8 * bytes` bits of `header`, whose content is the lowest `width` of them. Before the
  /// content, the stuffing sees alternating recessive and dominant bits that end with a recessive one, as on
  /// an idle bus; a CRC that starts with zero is not affected by leading zeros.
  void append_header(std::uint64_t header, int width, int bytes) noexcept {
    const std::uint64_t idle = 0x5555555555555555U << width;
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
      crc_ = crc15_byte(crc_, static_cast<std::uint8_t>(header >> shift));
      stuffing_.append_byte(static_cast<std::uint8_t>((header | idle) >> shift));
    }
  }

  void append(std::uint8_t byte) noexcept {
    crc_ = crc15_byte(crc_, byte);
    stuffing_.append_byte(byte);
  }

  /// Ends the region with the CRC and returns the number of all stuff bits.
  [[nodiscard]] int close() noexcept {
    stuffing_.append_byte(static_cast<std::uint8_t>(crc_ >> 7U));
    // The last byte is filled up with a bit of the opposite value, which follows the stuff bit at the end of
    // the CRC, if there is one, and causes none.
    stuffing_.append_byte(static_cast<std::uint8_t>(crc_ << 1U | (~crc_ & 1U)));
    return stuffing_.inserted();
  }

 private:
  std::uint32_t crc_ = 0;
  StuffCounter stuffing_;
};

// CRC and its delimiter.
constexpr int kCrcBits = 15 + 1;

// The same for FD frames.
constexpr unsigned kLongestShort = 16;       // bytes protected by CRC-17
constexpr int kShortCheck = 4 + 17 + 6 + 1;  // stuff count, CRC, fixed stuff bits, delimiter
constexpr int kLongCheck = 4 + 21 + 7 + 1;
constexpr int kStatusAndLength = 1 + 4;  // ESI, DLC

}  // namespace

int frame_bits(const can::Frame& frame) noexcept {
  assert(!frame.fd && frame.length <= 8);
  const unsigned rtr = frame.remote ? 1 : 0;
  StuffedRegion region;
  int header = 0;
  if (frame.extended) {
    // SOF, base identifier, SRR, IDE, identifier extension, RTR, r1, r0, DLC.
    header = 1 + 11 + 2 + 18 + 3 + 4;
    const std::uint64_t base = (frame.id >> 18U) << 2U | 0b11U;
    region.append_header((base << 18U | (frame.id & 0x3FFFFU)) << 7U | rtr << 6U | frame.length, header, 5);
  } else {
    // SOF, identifier, RTR, IDE, r0, DLC.
    header = 1 + 11 + 3 + 4;
    region.append_header(frame.id << 7U | rtr << 6U | frame.length, header, 3);
  }
  int data = 0;
  if (!frame.remote) {
    for (const std::uint8_t byte : frame.payload()) region.append(byte);
    data = 8 * frame.length;
  }
  return header + data + kCrcBits + region.close() + kAckAndEndBits + kIntermissionBits;
}

unsigned fd_length_code(unsigned length) noexcept {
  if (length <= 8) return length;
  if (length <= 24) return 9 + (length - 9) / 4;
  return length <= 32 ? 13 : length <= 48 ? 14 : 15;
}

// The CRC field of FD frames has its stuff bits at fixed positions, so that the CRC value does not affect the
// length.
WireLength wire_length(const can::Frame& frame, bool error_passive) noexcept {
  if (!frame.fd) return {frame_bits(frame), 0};
  const unsigned code = fd_length_code(frame.length);
  const unsigned length = can::fd_length(frame.length);

  // Up to BRS, at the nominal rate: SOF, identifier, RRS 0, IDE 0, FDF 1, res 0, BRS 1, or with an extended
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

bool is_sendable(const can::Frame& frame) noexcept {
  if (frame.error || frame.id > (frame.extended ? 0x1FFFFFFFU : 0x7FFU)) return false;
  if (!frame.fd) return frame.length <= 8;
  return !frame.remote && frame.length <= can::kMaxPayload && can::fd_length(frame.length) == frame.length;
}

}  // namespace walkman::bus
