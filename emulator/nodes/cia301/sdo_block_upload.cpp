#include <algorithm>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/cia301/block_crc.h"
#include "emulator/nodes/cia301/sdo_server.h"

namespace walkman::nodes {
namespace {

constexpr std::size_t kSegmentBytes = 7;

// Client sub-commands, bits 0-1.
constexpr unsigned kInitiate = 0;
constexpr unsigned kEnd = 1;
constexpr unsigned kAcknowledge = 2;
constexpr unsigned kStart = 3;

bool block_size_allowed(std::uint8_t size) noexcept { return size >= 1 && size <= 127; }

}  // namespace

std::size_t SdoServer::segment_count() const noexcept {
  return std::max<std::size_t>(1, (value_.size() + kSegmentBytes - 1) / kSegmentBytes);
}

void SdoServer::block_upload(Request request, Time now) noexcept {
  const unsigned command = request[0] & 0x03U;
  if (command == kInitiate) return start_block_upload(request, now);
  if (command == kStart && transfer_ == Transfer::kBlockUploadStart) {
    transfer_ = Transfer::kBlockUpload;
    deadline_ = now + kTimeout;
    return feed();
  }
  if (command == kAcknowledge && transfer_ == Transfer::kBlockUpload) {
    return block_upload_acknowledged(request, now);
  }
  if (command == kEnd && transfer_ == Transfer::kBlockUploadEnd) return reset();
  unexpected();
}

void SdoServer::start_block_upload(Request request, Time now) noexcept {
  if (!open_for_reading(request)) return;
  if (!block_size_allowed(request[4])) return abort(address_, SdoAbort::kBlockSize);
  // Up to the client's protocol switch threshold the ordinary upload has less overhead.
  const std::size_t threshold = request[5];
  if (threshold > 0 && value_.size() <= threshold) return answer_upload(now);
  crc_wanted_ = (request[0] & 0x04U) != 0;
  block_size_ = request[4];
  sequence_ = 0;
  acknowledged_ = 0;
  transfer_ = Transfer::kBlockUploadStart;
  deadline_ = now + kTimeout;
  std::array<std::uint8_t, 7> rest{};
  canopen::put(rest.data(), address_.index);
  rest[2] = address_.sub;
  canopen::put(rest.data() + 3, static_cast<std::uint32_t>(value_.size()));
  respond(0xC6, rest);
}

void SdoServer::feed() noexcept {
  const std::size_t next = acknowledged_ + sequence_;
  if (sequence_ == block_size_ || next == segment_count()) return;
  if (outbox_.full() || outbox_.holds(canopen::cob_id::sdo_response(node_id_))) return;
  const std::size_t offset = next * kSegmentBytes;
  const std::size_t count = std::min(kSegmentBytes, value_.size() - offset);
  const bool last = next + 1 == segment_count();
  ++sequence_;
  respond(static_cast<std::uint8_t>((last ? 0x80U : 0U) | sequence_), value_.subspan(offset, count));
}

void SdoServer::block_upload_acknowledged(Request request, Time now) noexcept {
  const std::uint8_t good = request[1];
  if (good > sequence_) return abort_transfer(SdoAbort::kSequence);
  if (!block_size_allowed(request[2])) return abort_transfer(SdoAbort::kBlockSize);
  // A client that has seen a gap may acknowledge before the block is out; the rest is not sent any more.
  outbox_.drop(canopen::cob_id::sdo_response(node_id_));
  deadline_ = now + kTimeout;
  acknowledged_ += good;
  sequence_ = 0;
  block_size_ = request[2];
  if (acknowledged_ < segment_count()) return feed();
  transfer_ = Transfer::kBlockUploadEnd;
  const std::size_t unused = segment_count() * kSegmentBytes - value_.size();
  std::array<std::uint8_t, 2> crc{};
  if (crc_wanted_) canopen::put(crc.data(), block_crc(value_));
  respond(static_cast<std::uint8_t>(0xC1U | unused << 2U), crc);
}

}  // namespace walkman::nodes
