#include "drivers/canopen/pdo_protection.h"

#include <boost/crc.hpp>

namespace walkman::canopen {
namespace {

// After a long silence, frames further behind than a bus can delay them count as new.
constexpr std::uint8_t kOldFrames = 16;

std::uint8_t checksum(const can::Frame& frame, std::size_t bytes) noexcept {
  boost::crc_optimal<8, 0x2F, 0xFF, 0xFF, false, false> crc;
  crc.process_byte(static_cast<std::uint8_t>(frame.id & 0xFFU));
  crc.process_byte(static_cast<std::uint8_t>(frame.id >> 8U & 0xFFU));
  crc.process_bytes(frame.data.data(), bytes - 1);
  return static_cast<std::uint8_t>(crc.checksum());
}

}  // namespace

void protect(can::Frame& frame, std::size_t bytes, std::uint8_t count) noexcept {
  frame.data[bytes - 2] = count;
  frame.data[bytes - 1] = checksum(frame, bytes);
}

PdoGuard::Verdict PdoGuard::judge(const can::Frame& frame, std::size_t bytes) noexcept {
  if (frame.data[bytes - 1] != checksum(frame, bytes)) return Verdict::kCorrupt;
  const std::uint8_t count = frame.data[bytes - 2];
  if (last_ && static_cast<std::uint8_t>(*last_ - count) < kOldFrames) return Verdict::kRepeated;
  last_ = count;
  return Verdict::kNew;
}

}  // namespace walkman::canopen
