#pragma once

#include <algorithm>
#include <string>

#include "drivers/can/frame.h"

namespace walkman::bus {

/// Second implementation of a frame's bits, for tests, written straight from the text of ISO 11898-1 with
/// strings of '0' and '1'. Shares no code with the model.
struct ReferenceBits {
  std::string bits;      ///< SOF to the last bit of the intermission
  std::size_t fast = 0;  ///< number of these at the data rate
  std::size_t unstuffed = 0;

  [[nodiscard]] int nominal() const { return static_cast<int>(bits.size() - fast); }
  [[nodiscard]] int data() const { return static_cast<int>(fast); }
};

inline std::string binary(unsigned value, int width) {
  std::string text;
  for (int i = 0; i < width; ++i) text.insert(text.begin(), (value >> i & 1U) != 0 ? '1' : '0');
  return text;
}

/// Inserts the opposite bit after every five equal bits, counting inserted ones; after the last bit only if
/// `after_last`.
inline std::string stuff(const std::string& in, bool after_last) {
  std::string out;
  for (std::size_t i = 0; i < in.size(); ++i) {
    out.push_back(in[i]);
    const std::string five(5, in[i]);
    const bool run = out.size() >= 5 && out.compare(out.size() - 5, 5, five) == 0;
    if (run && (i + 1 < in.size() || after_last)) out.push_back(in[i] == '0' ? '1' : '0');
  }
  return out;
}

/// Returns the remainder of a polynomial division by hand; `divisor` includes its leading term.
inline std::string remainder(std::string dividend, const std::string& divisor) {
  dividend.append(divisor.size() - 1, '0');
  for (std::size_t i = 0; i + divisor.size() <= dividend.size(); ++i) {
    if (dividend[i] == '0') continue;
    for (std::size_t k = 0; k < divisor.size(); ++k)
      dividend[i + k] = dividend[i + k] == divisor[k] ? '0' : '1';
  }
  return dividend.substr(dividend.size() - (divisor.size() - 1));
}

inline ReferenceBits reference_bits(const can::Frame& frame, bool error_passive = false) {
  const std::string id = frame.extended ? binary(frame.id >> 18U, 11) + "11" + binary(frame.id & 0x3FFFFU, 18)
                                        : binary(frame.id, 11);
  std::string data;
  if (!frame.remote) {
    for (const auto byte : frame.payload()) data += binary(byte, 8);
  }
  ReferenceBits out;
  if (!frame.fd) {
    // RTR, then IDE r0 or r1 r0.
    const std::string region = "0" + id + (frame.remote ? "1" : "0") + "00" + binary(frame.length, 4) + data;
    const std::string crc = remainder(region, "1100010110011001");
    out.bits = stuff(region + crc, true) + "1" + "1" + "1" + "1111111" + "111";
    out.unstuffed = region.size() + crc.size() + 13;
    return out;
  }
  const unsigned n = frame.length;
  const unsigned code = n <= 8 ? n : n <= 24 ? 9 + (n - 12) / 4 : n == 32 ? 13 : n == 48 ? 14 : 15;
  const std::string head = "0" + id + "0" + (frame.extended ? "" : "0") + "101";  // RRS, IDE, FDF, res, BRS
  const std::string region = head + (error_passive ? "1" : "0") + binary(code, 4) + data;
  const std::string stuffed = stuff(region, false);
  const std::string slow = stuff(head + "x", true);  // the bit after BRS cannot end a run
  const std::size_t stuff_bits = stuffed.size() - region.size();
  static const char* const kCount[8] = {"0000", "0011", "0110", "0101", "1100", "1111", "1010", "1001"};
  const std::string count = kCount[stuff_bits % 8];
  // A CRC that starts with a leading one equals the CRC of the stream with its first bit inverted.
  std::string checked = stuffed + count;
  checked.front() = checked.front() == '0' ? '1' : '0';
  const std::string crc = remainder(checked, n <= 16 ? "110110100001011011" : "1100000010100010011001");
  std::string tail;
  const std::string sequence = count + crc;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const char before = tail.empty() ? stuffed.back() : tail.back();
    if (i % 4 == 0) tail.push_back(before == '0' ? '1' : '0');
    tail.push_back(sequence[i]);
  }
  out.bits = stuffed + tail + "1" + "1" + "1" + "1111111" + "111";
  out.fast = stuffed.size() - (slow.size() - 1) + tail.size() + 1;
  out.unstuffed = region.size() + sequence.size() + 13;
  return out;
}

}  // namespace walkman::bus
