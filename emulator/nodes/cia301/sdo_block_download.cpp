#include <algorithm>

#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/cia301/block_crc.h"
#include "emulator/nodes/cia301/sdo_server.h"

namespace walkman::nodes {
namespace {

constexpr std::size_t kSegmentBytes = 7;
constexpr unsigned kAbortCommand = 0x80;
constexpr std::uint8_t kWithCrc = 0x04;

}  // namespace

void SdoServer::block_download(Request request, Time now) noexcept {
  const bool end = (request[0] & 0x01U) != 0;
  if (!end) return start_block_download(request, now);
  if (transfer_ != Transfer::kBlockDownloadEnd) return unexpected();
  end_block_download(request);
}

void SdoServer::start_block_download(Request request, Time now) noexcept {
  if (!open_for_writing(request)) return;
  crc_wanted_ = (request[0] & kWithCrc) != 0;
  size_announced_ = (request[0] & 0x02U) != 0;
  announced_ = canopen::get<std::uint32_t>(request.data() + 4);
  if (const Verdict refused = check_announced()) return abort(address_, *refused);
  transfer_ = Transfer::kBlockDownload;
  sequence_ = 0;
  complete_ = false;
  deadline_ = now + kTimeout;
  std::array<std::uint8_t, 7> rest{};
  canopen::put(rest.data(), address_.index);
  rest[2] = address_.sub;
  rest[3] = kBlockSize;
  respond(0xA0 | kWithCrc, rest);
}

void SdoServer::block_download_segment(Request request, Time now) noexcept {
  if (request[0] == kAbortCommand) return reset();
  const bool last = (request[0] & 0x80U) != 0;
  const auto sequence = static_cast<std::uint8_t>(request[0] & 0x7FU);
  if (sequence == 0 || sequence > kBlockSize) return abort_transfer(SdoAbort::kSequence);
  deadline_ = now + kTimeout;
  // After a gap the rest of the block is passed over; the client sends it again after the acknowledgement.
  if (sequence == sequence_ + 1) {
    // All seven bytes of the last segment may be unused.
    if (size_ > entry_->capacity()) return abort_transfer(SdoAbort::kTooLong);
    std::copy_n(request.begin() + 1, kSegmentBytes, buffer_.begin() + size_);
    size_ += kSegmentBytes;
    sequence_ = sequence;
    complete_ = last;
  }
  if (sequence != kBlockSize && !last) return;
  respond(0xA2, std::array<std::uint8_t, 2>{sequence_, kBlockSize});
  sequence_ = 0;
  if (complete_) transfer_ = Transfer::kBlockDownloadEnd;
}

void SdoServer::end_block_download(Request request) noexcept {
  const std::size_t unused = request[0] >> 2U & 0x07U;
  const auto value = std::span<const std::uint8_t>(buffer_).first(size_ - unused);
  if (size_announced_ && value.size() != announced_) return abort_transfer(SdoAbort::kLengthMismatch);
  const auto crc = canopen::get<std::uint16_t>(request.data() + 1);
  if (crc_wanted_ && crc != block_crc(value)) return abort_transfer(SdoAbort::kCrc);
  if (const Verdict refused = dictionary_.write(*entry_, value)) return abort_transfer(*refused);
  reset();
  respond(0xA1, {});
}

}  // namespace walkman::nodes
