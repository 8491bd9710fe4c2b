#include "emulator/nodes/cia301/sdo_server.h"

#include <algorithm>
#include <cstring>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/cia301/block_crc.h"

namespace walkman::nodes {

namespace {

// Client command specifiers, bits 5-7 of the first byte.
constexpr unsigned kDownloadSegment = 0;
constexpr unsigned kStartDownload = 1;
constexpr unsigned kStartUpload = 2;
constexpr unsigned kUploadSegment = 3;
constexpr unsigned kAbort = 4;
constexpr unsigned kBlockUpload = 5;
constexpr unsigned kBlockDownload = 6;

constexpr std::size_t kSegmentBytes = 7;

ObjectAddress address_of(std::span<const std::uint8_t, 8> request) noexcept {
  return {canopen::get<std::uint16_t>(request.data() + 1), request[3]};
}

// Block transfer: the abort command, the CRC flag, and client sub-commands, bits 0-1.
constexpr unsigned kAbortCommand = 0x80;
constexpr std::uint8_t kWithCrc = 0x04;

constexpr unsigned kInitiate = 0;
constexpr unsigned kEnd = 1;
constexpr unsigned kAcknowledge = 2;
constexpr unsigned kStart = 3;

bool block_size_allowed(std::uint8_t size) noexcept { return size >= 1 && size <= 127; }

}  // namespace

SdoServer::SdoServer(ObjectDictionary& dictionary, Outbox& outbox, const std::uint8_t& node_id)
    : dictionary_(dictionary), outbox_(outbox), node_id_(node_id) {}

void SdoServer::reset() noexcept {
  if (transfer_ == Transfer::kBlockUpload) outbox_.drop(canopen::cob_id::sdo_response(node_id_));
  transfer_ = Transfer::kNone;
  deadline_ = Time::max();
}

void SdoServer::respond(std::uint8_t command, std::span<const std::uint8_t> rest) noexcept {
  can::Frame frame;
  frame.id = canopen::cob_id::sdo_response(node_id_);
  frame.length = 8;
  frame.data[0] = command;
  std::copy(rest.begin(), rest.end(), frame.data.begin() + 1);
  outbox_.push(frame);
}

void SdoServer::respond_address(std::uint8_t command, ObjectAddress address) noexcept {
  std::array<std::uint8_t, 3> rest{};
  canopen::put(rest.data(), address.index);
  rest[2] = address.sub;
  respond(command, rest);
}

void SdoServer::abort(ObjectAddress address, SdoAbort code) noexcept {
  std::array<std::uint8_t, 7> rest{};
  canopen::put(rest.data(), address.index);
  rest[2] = address.sub;
  canopen::put(rest.data() + 3, static_cast<std::uint32_t>(code));
  respond(0x80, rest);
}

void SdoServer::abort_transfer(SdoAbort code) noexcept {
  reset();
  abort(address_, code);
}

/// Handles a command that does not belong to the transfer under way, or comes without one.
void SdoServer::unexpected() noexcept {
  if (transfer_ == Transfer::kNone) address_ = {};
  abort_transfer(SdoAbort::kCommand);
}

void SdoServer::advance(Time now) noexcept {
  if (deadline_ <= now) abort_transfer(SdoAbort::kTimeout);
}

void SdoServer::receive(const can::Frame& frame, Time now) noexcept {
  if (frame.length != 8) return;
  const Request request(frame.data.data(), 8);
  if (transfer_ == Transfer::kBlockDownload) return block_download_segment(request, now);
  switch (request[0] >> 5U) {
    case kStartDownload:
      return start_download(request, now);
    case kDownloadSegment:
      return download_segment(request, now);
    case kStartUpload:
      return start_upload(request, now);
    case kUploadSegment:
      return upload_segment(request, now);
    case kAbort:
      return reset();
    case kBlockUpload:
      return block_upload(request, now);
    case kBlockDownload:
      return block_download(request, now);
    default:
      return unexpected();
  }
}

void SdoServer::stop_refusing(std::uint16_t index) {
  const auto found = std::find_if(refused_.begin(), refused_.end(),
                                  [&](const RefusedObject& one) { return one.index == index; });
  if (found != refused_.end()) refused_.erase(found);
}

bool SdoServer::find_object(Request request) noexcept {
  reset();
  address_ = address_of(request);
  for (const RefusedObject& one : refused_) {
    if (one.index != address_.index) continue;
    abort(address_, one.code);
    return false;
  }
  entry_ = dictionary_.find(address_.index, address_.sub);
  if (entry_ == nullptr) abort(address_, dictionary_.missing(address_.index));
  return entry_ != nullptr;
}

bool SdoServer::open_for_writing(Request request) noexcept {
  if (!find_object(request)) return false;
  if (!entry_->writable()) {
    abort(address_, SdoAbort::kReadOnly);
    return false;
  }
  size_ = 0;
  return true;
}

bool SdoServer::open_for_reading(Request request) noexcept {
  if (!find_object(request)) return false;
  if (const Refusal refused = dictionary_.read(*entry_)) {
    abort(address_, *refused);
    return false;
  }
  value_ = entry_->bytes();
  position_ = 0;
  return true;
}

Refusal SdoServer::check_announced() const noexcept {
  if (!size_announced_) return std::nullopt;
  if (announced_ > entry_->capacity()) return SdoAbort::kTooLong;
  if (entry_->number() && announced_ < entry_->size()) return SdoAbort::kTooShort;
  return std::nullopt;
}

void SdoServer::start_download(Request request, Time now) noexcept {
  if (!open_for_writing(request)) return;
  const bool expedited = (request[0] & 0x02U) != 0;
  size_announced_ = (request[0] & 0x01U) != 0;
  if (expedited) {
    // Without a size, a number has as many bytes as the object, a string all four.
    const std::size_t size =
        size_announced_ ? 4U - (request[0] >> 2U & 0x03U) : std::min<std::size_t>(entry_->capacity(), 4);
    if (const Refusal refused = dictionary_.write(*entry_, request.subspan(4, size)))
      return abort(address_, *refused);
    return respond_address(0x60, address_);
  }
  announced_ = canopen::get<std::uint32_t>(request.data() + 4);
  if (const Refusal refused = check_announced()) return abort(address_, *refused);
  transfer_ = Transfer::kDownload;
  toggle_ = false;
  deadline_ = now + kTimeout;
  respond_address(0x60, address_);
}

void SdoServer::download_segment(Request request, Time now) noexcept {
  if (transfer_ != Transfer::kDownload) return unexpected();
  const bool toggle = (request[0] & 0x10U) != 0;
  if (toggle != toggle_) return abort_transfer(SdoAbort::kToggle);
  const std::size_t count = kSegmentBytes - (request[0] >> 1U & 0x07U);
  if (size_ + count > entry_->capacity()) return abort_transfer(SdoAbort::kTooLong);
  std::copy_n(request.begin() + 1, count, buffer_.begin() + size_);
  size_ += count;
  const bool last = (request[0] & 0x01U) != 0;
  if (last) {
    if (size_announced_ && size_ != announced_) return abort_transfer(SdoAbort::kLengthMismatch);
    if (const Refusal refused = dictionary_.write(*entry_, std::span(buffer_).first(size_))) {
      return abort_transfer(*refused);
    }
    reset();
  } else {
    toggle_ = !toggle_;
    deadline_ = now + kTimeout;
  }
  respond(toggle ? 0x30 : 0x20, {});
}

void SdoServer::start_upload(Request request, Time now) noexcept {
  if (open_for_reading(request)) answer_upload(now);
}

void SdoServer::answer_upload(Time now) noexcept {
  std::array<std::uint8_t, 7> rest{};
  canopen::put(rest.data(), address_.index);
  rest[2] = address_.sub;
  const std::size_t size = value_.size();
  if (size >= 1 && size <= 4) {
    std::copy(value_.begin(), value_.end(), rest.begin() + 3);
    return respond(static_cast<std::uint8_t>(0x43U | (4U - size) << 2U), rest);
  }
  transfer_ = Transfer::kUpload;
  toggle_ = false;
  deadline_ = now + kTimeout;
  canopen::put(rest.data() + 3, static_cast<std::uint32_t>(size));
  respond(0x41, rest);
}

void SdoServer::upload_segment(Request request, Time now) noexcept {
  if (transfer_ != Transfer::kUpload) return unexpected();
  const bool toggle = (request[0] & 0x10U) != 0;
  if (toggle != toggle_) return abort_transfer(SdoAbort::kToggle);
  const std::size_t count = std::min(kSegmentBytes, value_.size() - position_);
  const bool last = position_ + count == value_.size();
  const auto command =
      static_cast<std::uint8_t>((toggle ? 0x10U : 0U) | (kSegmentBytes - count) << 1U | (last ? 1U : 0U));
  const auto segment = value_.subspan(position_, count);
  if (last) {
    reset();
  } else {
    position_ += count;
    toggle_ = !toggle_;
    deadline_ = now + kTimeout;
  }
  respond(command, segment);
}

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
  if (const Refusal refused = check_announced()) return abort(address_, *refused);
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
  // After a gap the rest of the block is ignored; the client sends it again after the acknowledgement.
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
  if (const Refusal refused = dictionary_.write(*entry_, value)) return abort_transfer(*refused);
  reset();
  respond(0xA1, {});
}

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
  // Up to the client's protocol switch threshold, the ordinary upload has less overhead.
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
  // A client that has seen a gap may acknowledge before the whole block is sent; the rest is then not sent.
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
