#include "drivers/can/frame_time.h"

#include <cmath>

#include "drivers/can/frame.h"

namespace walkman::can {

Time worst_frame_time(std::size_t bytes, const BitRates& rates) noexcept {
  constexpr std::size_t kClassicalBytes = 8;
  constexpr std::size_t kFdShortCrcBytes = 16;
  double time = 0;
  if (bytes <= kClassicalBytes) {
    // Start of frame to CRC sequence is stuffed; delimiters, acknowledgement, end and intermission are not.
    const std::size_t stuffed = 34 + 8 * bytes;
    time = static_cast<double>(stuffed + (stuffed - 1) / 4 + 13) / rates.nominal;
  } else {
    const std::size_t padded = fd_length(bytes);
    const std::size_t dynamic = 1 + 4 + 8 * padded;
    const std::size_t crc = padded <= kFdShortCrcBytes ? 17 + 6 : 21 + 7;
    const std::size_t data_bits = dynamic + dynamic / 4 + 4 + crc + 1;
    constexpr std::size_t kNominalBits = 17 + 4 + 12;
    time = static_cast<double>(kNominalBits) / rates.nominal + static_cast<double>(data_bits) / rates.data;
  }
  return Time(std::llround(time * 1e9));
}

}  // namespace walkman::can
