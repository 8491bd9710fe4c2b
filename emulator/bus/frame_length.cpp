#include "emulator/bus/frame_length.h"

#include <cassert>

namespace walkman::bus {
namespace {

// CRC delimiter, ACK slot, ACK delimiter, end of frame.
constexpr int kTailBits = 1 + 1 + 1 + 7;

/// Takes the bits of the stuffed region one after the other, counts them and the stuff bits among them.
class BitCounter {
 public:
  void append(std::uint32_t value, int width) noexcept {
    for (int i = width - 1; i >= 0; --i) {
      const unsigned bit = (value >> i) & 1U;
      const unsigned feedback = bit ^ ((crc_ >> 14U) & 1U);
      crc_ = (crc_ << 1U) & 0x7FFFU;
      if (feedback != 0) crc_ ^= 0x4599U;
      count(bit);
    }
  }

  void append_crc() noexcept {
    for (int i = 14; i >= 0; --i) count((crc_ >> i) & 1U);
  }

  [[nodiscard]] int bits() const noexcept { return bits_; }

 private:
  void count(unsigned bit) noexcept {
    ++bits_;
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    if (run_ == 5) {
      // The stuff bit has the opposite value and starts the next run.
      ++bits_;
      last_ = bit ^ 1U;
      run_ = 1;
    }
  }

  unsigned crc_ = 0;
  unsigned last_ = 2;
  int run_ = 0;
  int bits_ = 0;
};

}  // namespace

int frame_bits(const can::Frame& frame) noexcept {
  assert(!frame.fd && frame.length <= 8);
  const unsigned rtr = frame.remote ? 1 : 0;
  BitCounter counter;
  counter.append(0, 1);
  if (frame.extended) {
    counter.append(frame.id >> 18U, 11);
    counter.append(0b11, 2);  // SRR, IDE
    counter.append(frame.id & 0x3FFFFU, 18);
    counter.append(rtr << 2U, 3);  // RTR, r1, r0
  } else {
    counter.append(frame.id, 11);
    counter.append(rtr << 2U, 3);  // RTR, IDE, r0
  }
  counter.append(frame.length, 4);
  if (!frame.remote) {
    for (const std::uint8_t byte : frame.payload()) counter.append(byte, 8);
  }
  counter.append_crc();
  return counter.bits() + kTailBits + kIntermissionBits;
}

std::uint32_t arbitration_key(const can::Frame& frame) noexcept {
  const std::uint32_t rtr = frame.remote ? 1 : 0;
  if (!frame.extended) return frame.id << 21U | rtr << 20U;
  // Base identifier, SRR, IDE, identifier extension, RTR.
  return (frame.id >> 18U) << 21U | 1U << 20U | 1U << 19U | (frame.id & 0x3FFFFU) << 1U | rtr;
}

}  // namespace walkman::bus
