#include "emulator/bus/candump_log.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace walkman::bus {
namespace {

constexpr std::string_view kHex = "0123456789ABCDEF";
constexpr std::size_t kBatchReserve = 4096;

/// Longest line: time, interface, 8-digit identifier, FD mark and 64 bytes.
constexpr std::size_t kLongestTail = 16 + 2 * can::kMaxPayload;

std::size_t format_frame(std::array<char, kLongestTail>& out, const can::Frame& frame) {
  std::size_t n = 0;
  const int digits = frame.extended ? 8 : 3;
  for (int i = digits - 1; i >= 0; --i) out[n++] = kHex[frame.id >> (4 * i) & 0xFU];
  out[n++] = '#';
  if (frame.remote) {
    out[n++] = 'R';
    if (frame.length > 0) out[n++] = kHex[frame.length & 0xFU];
  } else {
    if (frame.fd) {
      out[n++] = '#';
      out[n++] = '0';
    }
    for (const std::uint8_t byte : frame.payload()) {
      out[n++] = kHex[byte >> 4U];
      out[n++] = kHex[byte & 0xFU];
    }
  }
  out[n++] = '\n';
  return n;
}

std::string_view format_time(std::array<char, 32>& out, Time time) {
  const std::int64_t us = time.count() / 1000;
  const int n = std::snprintf(out.data(), out.size(), "(%010" PRId64 ".%06" PRId64 ") ", us / 1'000'000,
                              us % 1'000'000);
  return {out.data(), static_cast<std::size_t>(n)};
}

}  // namespace

std::string candump_line(std::string_view interface_name, const can::StampedFrame& frame) {
  std::array<char, 32> time;
  std::array<char, kLongestTail> tail;
  std::string line(format_time(time, frame.time));
  line.append(interface_name).push_back(' ');
  line.append(tail.data(), format_frame(tail, frame.frame));
  return line;
}

CandumpLog::CandumpLog(std::filesystem::path file) : file_(std::move(file)), stream_(file_) {
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": cannot be created (" + std::strerror(errno) +
                             "), expected a writable path for the CAN log");
  }
  batch_.reserve(kBatchReserve);
  order_.reserve(kBatchReserve);
}

void CandumpLog::commit() {
  order_.clear();
  for (std::size_t i = 0; i < batch_.size(); ++i) order_.emplace_back(batch_[i].frame.time, i);
  std::sort(order_.begin(), order_.end());
  std::array<char, 32> time;
  std::array<char, kLongestTail> tail;
  for (const auto& [when, i] : order_) {
    const Record& record = batch_[i];
    stream_ << format_time(time, when) << record.interface_name << ' ';
    stream_.write(tail.data(), static_cast<std::streamsize>(format_frame(tail, record.frame.frame)));
  }
  batch_.clear();
}

void CandumpLog::flush() {
  commit();
  stream_.flush();
  if (!stream_)
    throw std::runtime_error(file_.string() +
                             ": CAN log could not be written completely, expected space on the device");
}

}  // namespace walkman::bus
