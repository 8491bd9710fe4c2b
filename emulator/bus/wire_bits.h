#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/frame.h"
#include "emulator/bus/frame_length.h"

namespace walkman::bus {

/// Part of a frame; the numbers are those of linux/can/error.h (CAN_ERR_PROT_LOC_*).
enum class FrameField : std::uint8_t {
  kStartOfFrame = 0x03,
  kIdentifier28To21 = 0x02,  ///< and 10..3 of a base frame
  kIdentifier20To18 = 0x06,
  kSubstituteRemote = 0x04,
  kExtension = 0x05,  ///< IDE
  kIdentifier17To13 = 0x07,
  kIdentifier12To5 = 0x0F,
  kIdentifier4To0 = 0x0E,
  kRemoteRequest = 0x0C,
  kReserved1 = 0x0D,
  kReserved0 = 0x09,
  kLengthCode = 0x0B,
  kData = 0x0A,
  kCrc = 0x08,
  kCrcDelimiter = 0x18,
  kAckSlot = 0x19,
  kAckDelimiter = 0x1B,
  kEndOfFrame = 0x1A,
};

/// A frame bit by bit as its sender puts it on the wire, stuff bits included, from SOF to the last bit of the
/// end of frame; the ACK slot is recessive. For events within a frame: errors, and two frames with the same
/// identifier.
class WireBits {
 public:
  explicit WireBits(const can::Frame& frame, bool error_passive = false) noexcept;

  [[nodiscard]] int size() const noexcept { return size_; }
  /// 0 dominant, 1 recessive.
  [[nodiscard]] unsigned level(int bit) const noexcept { return at(bit).level; }
  /// Whether the bit is sent at the data rate.
  [[nodiscard]] bool fast(int bit) const noexcept { return at(bit).fast; }
  [[nodiscard]] FrameField field(int bit) const noexcept { return at(bit).field; }
  [[nodiscard]] int ack_slot() const noexcept { return size_ - kAckAndEndBits; }

  /// Length up to the end of bit number `bit`.
  [[nodiscard]] WireLength length_to(int bit) const noexcept;

 private:
  // An FD frame with a 29-bit identifier and 64 bytes: 41 + 512 bits, 138 stuff bits, 33 of stuff count and
  // CRC, 9 of ACK and end of frame.
  static constexpr int kCapacity = 41 + 512 + 138 + 33 + kAckAndEndBits;

  struct Bit {
    std::uint8_t level;
    bool fast;
    FrameField field;
  };
  class Writer;

  [[nodiscard]] const Bit& at(int bit) const noexcept { return bits_[static_cast<std::size_t>(bit)]; }

  std::array<Bit, kCapacity> bits_;
  int size_ = 0;
};

}  // namespace walkman::bus
