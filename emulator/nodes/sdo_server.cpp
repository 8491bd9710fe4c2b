#include "emulator/nodes/sdo_server.h"

#include <algorithm>
#include <cstring>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"

namespace walkman::nodes {
namespace {

// Client command specifiers, bits 5-7 of the first byte.
constexpr unsigned kDownloadSegment = 0;
constexpr unsigned kStartDownload = 1;
constexpr unsigned kStartUpload = 2;
constexpr unsigned kUploadSegment = 3;
constexpr unsigned kAbort = 4;

constexpr std::size_t kSegmentBytes = 7;

ObjectAddress address_of(std::span<const std::uint8_t, 8> request) noexcept {
  return {canopen::get<std::uint16_t>(request.data() + 1), request[3]};
}

}  // namespace

SdoServer::SdoServer(ObjectDictionary& dictionary, Outbox& outbox, std::uint8_t node_id)
    : dictionary_(dictionary), outbox_(outbox), node_id_(node_id) {
  dictionary.add<std::uint8_t>(0x1200, 0, Access::kConst, 2);
  dictionary.add<std::uint32_t>(0x1200, 1, Access::kReadOnly, canopen::cob_id::sdo_request(node_id));
  dictionary.add<std::uint32_t>(0x1200, 2, Access::kReadOnly, canopen::cob_id::sdo_response(node_id));
}

void SdoServer::reset() noexcept {
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
  abort(address_, code);
  reset();
}

void SdoServer::advance(Time now) noexcept {
  if (deadline_ <= now) abort_transfer(SdoAbort::kTimeout);
}

void SdoServer::receive(const can::Frame& frame, Time now) noexcept {
  if (frame.length != 8) return;
  const Request request(frame.data.data(), 8);
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
    default:
      reset();
      return abort(address_of(request), SdoAbort::kCommand);
  }
}

void SdoServer::start_download(Request request, Time now) noexcept {
  reset();
  const ObjectAddress address = address_of(request);
  Entry* entry = dictionary_.find(address.index, address.sub);
  if (entry == nullptr) return abort(address, dictionary_.missing(address.index));
  if (!entry->writable()) return abort(address, SdoAbort::kReadOnly);

  const bool expedited = (request[0] & 0x02U) != 0;
  const bool size_given = (request[0] & 0x01U) != 0;
  if (expedited) {
    // Without a size the value has as many bytes as the object.
    const std::size_t size =
        size_given ? 4U - (request[0] >> 2U & 0x03U) : std::min<std::size_t>(entry->size(), 4);
    if (const Verdict refused = dictionary_.write(*entry, request.subspan(4, size)))
      return abort(address, *refused);
    return respond_address(0x60, address);
  }
  announced_ = size_given ? canopen::get<std::uint32_t>(request.data() + 4) : 0;
  if (size_given && announced_ != entry->size()) {
    return abort(address, announced_ > entry->size() ? SdoAbort::kTooLong : SdoAbort::kTooShort);
  }
  transfer_ = Transfer::kDownload;
  address_ = address;
  entry_ = entry;
  toggle_ = false;
  size_ = 0;
  deadline_ = now + kTimeout;
  respond_address(0x60, address);
}

void SdoServer::download_segment(Request request, Time now) noexcept {
  if (transfer_ != Transfer::kDownload) return abort({}, SdoAbort::kCommand);
  const bool toggle = (request[0] & 0x10U) != 0;
  if (toggle != toggle_) return abort_transfer(SdoAbort::kToggle);
  const std::size_t count = kSegmentBytes - (request[0] >> 1U & 0x07U);
  if (size_ + count > entry_->size()) return abort_transfer(SdoAbort::kTooLong);
  std::copy_n(request.begin() + 1, count, buffer_.begin() + size_);
  size_ += count;
  const bool last = (request[0] & 0x01U) != 0;
  if (last) {
    if (const Verdict refused = dictionary_.write(*entry_, std::span(buffer_).first(size_))) {
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
  reset();
  const ObjectAddress address = address_of(request);
  const Entry* entry = dictionary_.find(address.index, address.sub);
  if (entry == nullptr) return abort(address, dictionary_.missing(address.index));
  if (const Verdict refused = dictionary_.read(*entry)) return abort(address, *refused);

  const bool text = entry->type == DataType::kVisibleString;
  size_ = std::min(entry->size(), kMaxBytes);
  const void* value = text ? static_cast<const void*>(entry->text.data()) : &entry->raw;
  std::memcpy(buffer_.data(), value, size_);

  std::array<std::uint8_t, 7> rest{};
  canopen::put(rest.data(), address.index);
  rest[2] = address.sub;
  if (size_ >= 1 && size_ <= 4) {
    std::copy_n(buffer_.begin(), size_, rest.begin() + 3);
    return respond(static_cast<std::uint8_t>(0x43U | (4U - size_) << 2U), rest);
  }
  transfer_ = Transfer::kUpload;
  address_ = address;
  toggle_ = false;
  position_ = 0;
  deadline_ = now + kTimeout;
  canopen::put(rest.data() + 3, static_cast<std::uint32_t>(size_));
  respond(0x41, rest);
}

void SdoServer::upload_segment(Request request, Time now) noexcept {
  if (transfer_ != Transfer::kUpload) return abort({}, SdoAbort::kCommand);
  const bool toggle = (request[0] & 0x10U) != 0;
  if (toggle != toggle_) return abort_transfer(SdoAbort::kToggle);
  const std::size_t count = std::min(kSegmentBytes, size_ - position_);
  const bool last = position_ + count == size_;
  const auto command =
      static_cast<std::uint8_t>((toggle ? 0x10U : 0U) | (kSegmentBytes - count) << 1U | (last ? 1U : 0U));
  const auto segment = std::span(buffer_).subspan(position_, count);
  if (last) {
    reset();
  } else {
    position_ += count;
    toggle_ = !toggle_;
    deadline_ = now + kTimeout;
  }
  respond(command, segment);
}

}  // namespace walkman::nodes
