#include "emulator/bus/wire_bits.h"

#include "emulator/bus/wire_coding.h"

namespace walkman::bus {

/// Appends to the bits, with stuff bits and CRC as the frame's format requires.
class WireBits::Writer {
 public:
  Writer(WireBits& out, const CrcKind& crc, bool crc_sees_stuff_bits) noexcept
      : out_(out), kind_(crc), crc_sees_stuff_bits_(crc_sees_stuff_bits), crc_(crc.start) {}

  void set_fast(bool fast) noexcept { fast_ = fast; }

  /// Appends `width` bits of the stuffed region.
  void stuffed(FrameField field, std::uint32_t value, int width) noexcept {
    for (int i = width - 1; i >= 0; --i) {
      insert_if_due(field);
      const unsigned bit = (value >> i) & 1U;
      crc_ = crc_bit(kind_, crc_, bit);
      put(field, bit);
    }
  }

  /// Appends a stuff bit if one is due, also at the end of the stuffed region.
  void insert_if_due(FrameField field) noexcept {
    if (run_ < 5) return;
    const unsigned bit = last_ ^ 1U;
    if (crc_sees_stuff_bits_) crc_ = crc_bit(kind_, crc_, bit);
    ++stuff_bits_;
    run_ = 0;
    put(field, bit);
  }

  /// Appends the CRC-15, which is stuffed as well.
  void classical_check() noexcept {
    const std::uint32_t crc = crc_;
    stuffed(FrameField::kCrc, crc, kind_.width);
    insert_if_due(FrameField::kCrc);
  }

  /// Appends the stuff count and CRC of FD, with a fixed stuff bit first and after every four bits.
  void fd_check() noexcept {
    static constexpr std::array<std::uint8_t, 8> kGrayWithParity = {0b0000, 0b0011, 0b0110, 0b0101,
                                                                    0b1100, 0b1111, 0b1010, 0b1001};
    const unsigned count = kGrayWithParity[stuff_bits_ % 8U];
    for (int i = 3; i >= 0; --i) crc_ = crc_bit(kind_, crc_, (count >> i) & 1U);
    const std::uint64_t sequence = static_cast<std::uint64_t>(count) << kind_.width | crc_;
    const int width = 4 + kind_.width;
    for (int i = 0; i < width; ++i) {
      if (i % 4 == 0) put(FrameField::kCrc, last_ ^ 1U);
      put(FrameField::kCrc, static_cast<unsigned>(sequence >> (width - 1 - i)) & 1U);
    }
  }

  void put(FrameField field, unsigned bit) noexcept {
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    out_.bits_[static_cast<std::size_t>(out_.size_++)] = {static_cast<std::uint8_t>(bit), fast_, field};
  }

 private:
  WireBits& out_;
  const CrcKind& kind_;
  bool crc_sees_stuff_bits_;
  bool fast_ = false;
  std::uint32_t crc_;
  unsigned last_ = 1;
  int run_ = 0;
  unsigned stuff_bits_ = 0;
};

WireBits::WireBits(const can::Frame& frame, bool error_passive) noexcept {
  const unsigned code = frame.fd ? fd_length_code(frame.length) : frame.length;
  const unsigned length = frame.remote ? 0 : frame.fd ? can::fd_length(frame.length) : frame.length;
  Writer writer(*this, !frame.fd ? kCrc15 : length <= 16 ? kCrc17 : kCrc21, frame.fd);
  const unsigned rtr = frame.remote ? 1 : 0;

  writer.stuffed(FrameField::kStartOfFrame, 0, 1);
  const std::uint32_t base = frame.extended ? frame.id >> 18U : frame.id;
  writer.stuffed(FrameField::kIdentifier28To21, base >> 3U, 8);
  writer.stuffed(FrameField::kIdentifier20To18, base & 7U, 3);
  if (frame.extended) {
    writer.stuffed(FrameField::kSubstituteRemote, 1, 1);
    writer.stuffed(FrameField::kExtension, 1, 1);
    writer.stuffed(FrameField::kIdentifier17To13, (frame.id >> 13U) & 0x1FU, 5);
    writer.stuffed(FrameField::kIdentifier12To5, (frame.id >> 5U) & 0xFFU, 8);
    writer.stuffed(FrameField::kIdentifier4To0, frame.id & 0x1FU, 5);
  }
  writer.stuffed(FrameField::kRemoteRequest, rtr, 1);
  if (!frame.extended) writer.stuffed(FrameField::kExtension, 0, 1);
  if (frame.fd) {
    writer.stuffed(FrameField::kReserved1, 0b10, 2);  // FDF, res
    writer.stuffed(FrameField::kReserved0, 1, 1);     // BRS
    writer.set_fast(true);
    writer.stuffed(FrameField::kReserved0, error_passive ? 1 : 0, 1);  // ESI
  } else {
    if (frame.extended) writer.stuffed(FrameField::kReserved1, 0, 1);
    writer.stuffed(FrameField::kReserved0, 0, 1);
  }
  writer.stuffed(FrameField::kLengthCode, code, 4);
  for (unsigned i = 0; i < length; ++i) writer.stuffed(FrameField::kData, frame.data[i], 8);
  if (frame.fd) {
    writer.fd_check();
  } else {
    writer.classical_check();
  }
  writer.put(FrameField::kCrcDelimiter, 1);
  writer.set_fast(false);
  writer.put(FrameField::kAckSlot, 1);
  writer.put(FrameField::kAckDelimiter, 1);
  for (int i = 0; i < 7; ++i) writer.put(FrameField::kEndOfFrame, 1);
}

WireLength WireBits::length_to(int bit) const noexcept {
  WireLength length;
  for (int i = 0; i <= bit; ++i) ++(at(i).fast ? length.data : length.nominal);
  return length;
}

}  // namespace walkman::bus
