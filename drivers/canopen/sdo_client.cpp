#include "drivers/canopen/sdo_client.h"

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"

namespace walkman::canopen {
namespace {

// Command specifiers, byte 0 (CiA 301, 7.2.4.3).
constexpr std::uint8_t kUploadStart = 0x40;
constexpr std::uint8_t kUploadSegment = 0x60;
constexpr std::uint8_t kDownloadStart = 0x21;  // segmented, size given
constexpr std::uint8_t kAbort = 0x80;
constexpr std::uint8_t kToggleBit = 0x10;
constexpr std::size_t kSegmentBytes = 7;

}  // namespace

void SdoClient::begin(ObjectAddress address, Awaiting awaiting, Time now) noexcept {
  address_ = address;
  awaiting_ = awaiting;
  state_ = State::kBusy;
  toggle_ = announced_ = aborted_by_server_ = false;
  size_ = expected_ = transferred_ = 0;
  asked_at_ = now;
}

void SdoClient::request(std::uint8_t command, Time now) noexcept {
  pending_ = can::Frame(cob_id::sdo_request(server_), {command, 0, 0, 0, 0, 0, 0, 0});
  has_pending_ = true;
  asked_at_ = now;
}

void SdoClient::upload(ObjectAddress address, Time now) noexcept {
  begin(address, Awaiting::kUploadStart, now);
  request(kUploadStart, now);
  put(pending_.data.data() + 1, address.index);
  pending_.data[3] = address.sub;
}

void SdoClient::download(ObjectAddress address, std::span<const std::uint8_t> bytes, Time now) noexcept {
  begin(address, Awaiting::kDownloadStart, now);
  if (bytes.empty() || bytes.size() > kCapacity) {
    state_ = State::kFailed;
    abort_code_ = bytes.empty() ? SdoAbort::kTooShort : SdoAbort::kMemory;
    return;
  }
  size_ = bytes.size();
  std::memcpy(buffer_.data(), bytes.data(), size_);
  const bool expedited = size_ <= 4;
  request(expedited ? static_cast<std::uint8_t>(0x23 | (4 - size_) << 2) : kDownloadStart, now);
  put(pending_.data.data() + 1, address.index);
  pending_.data[3] = address.sub;
  if (expedited) {
    std::memcpy(pending_.data.data() + 4, buffer_.data(), size_);
    transferred_ = size_;
  } else {
    put(pending_.data.data() + 4, static_cast<std::uint32_t>(size_));
  }
}

void SdoClient::reset() noexcept {
  state_ = State::kIdle;
  has_pending_ = false;
}

void SdoClient::abort(SdoAbort code) noexcept {
  request(kAbort, asked_at_);
  put(pending_.data.data() + 1, address_.index);
  pending_.data[3] = address_.sub;
  put(pending_.data.data() + 4, static_cast<std::uint32_t>(code));
  abort_code_ = code;
  state_ = State::kFailed;
}

void SdoClient::poll(Time now) noexcept {
  if (state_ == State::kBusy && now - asked_at_ >= timeout_) abort(SdoAbort::kTimeout);
}

void SdoClient::receive(const can::Frame& frame, Time now) noexcept {
  if (state_ != State::kBusy || frame.length != 8) return;
  const bool same_object =
      get<std::uint16_t>(frame.data.data() + 1) == address_.index && frame.data[3] == address_.sub;
  if (frame.data[0] == kAbort) {
    if (!same_object) return;
    abort_code_ = static_cast<SdoAbort>(get<std::uint32_t>(frame.data.data() + 4));
    aborted_by_server_ = true;
    has_pending_ = false;
    state_ = State::kFailed;
    return;
  }
  switch (awaiting_) {
    case Awaiting::kUploadStart:
      if (same_object) on_upload_start(frame, now);
      return;
    case Awaiting::kDownloadStart:
      if (same_object) on_download(frame, now);
      return;
    case Awaiting::kUploadSegment:
      on_upload_segment(frame, now);
      return;
    case Awaiting::kDownloadSegment:
      on_download(frame, now);
      return;
  }
}

void SdoClient::on_upload_start(const can::Frame& frame, Time now) noexcept {
  const std::uint8_t command = frame.data[0];
  if ((command & 0xE0) != 0x40) return abort(SdoAbort::kCommand);
  const bool size_given = (command & 1) != 0;
  if ((command & 2) != 0) {
    size_ = size_given ? 4U - ((command >> 2) & 3U) : 4U;
    std::memcpy(buffer_.data(), frame.data.data() + 4, size_);
    state_ = State::kDone;
    return;
  }
  announced_ = size_given;
  expected_ = get<std::uint32_t>(frame.data.data() + 4);
  if (announced_ && expected_ > kCapacity) return abort(SdoAbort::kMemory);
  awaiting_ = Awaiting::kUploadSegment;
  request(kUploadSegment, now);
}

void SdoClient::on_upload_segment(const can::Frame& frame, Time now) noexcept {
  const std::uint8_t command = frame.data[0];
  if ((command & 0xE0) != 0) return abort(SdoAbort::kCommand);
  if (((command & kToggleBit) != 0) != toggle_) return abort(SdoAbort::kToggle);
  const std::size_t count = kSegmentBytes - ((command >> 1) & 7U);
  if (announced_ && size_ + count > expected_) return abort(SdoAbort::kTooLong);
  if (size_ + count > kCapacity) return abort(SdoAbort::kMemory);
  std::memcpy(buffer_.data() + size_, frame.data.data() + 1, count);
  size_ += count;
  if ((command & 1) != 0) {
    if (announced_ && size_ != expected_) return abort(SdoAbort::kTooShort);
    state_ = State::kDone;
    return;
  }
  toggle_ = !toggle_;
  request(static_cast<std::uint8_t>(kUploadSegment | (toggle_ ? kToggleBit : 0)), now);
}

void SdoClient::on_download(const can::Frame& frame, Time now) noexcept {
  const std::uint8_t command = frame.data[0];
  if (awaiting_ == Awaiting::kDownloadStart) {
    if (command != 0x60) return abort(SdoAbort::kCommand);
    awaiting_ = Awaiting::kDownloadSegment;
  } else {
    if ((command & 0xEF) != 0x20) return abort(SdoAbort::kCommand);
    if (((command & kToggleBit) != 0) != toggle_) return abort(SdoAbort::kToggle);
    toggle_ = !toggle_;
  }
  if (transferred_ == size_) {
    state_ = State::kDone;
  } else {
    send_segment(now);
  }
}

void SdoClient::send_segment(Time now) noexcept {
  const std::size_t count = std::min(kSegmentBytes, size_ - transferred_);
  const bool last = transferred_ + count == size_;
  request(static_cast<std::uint8_t>((toggle_ ? kToggleBit : 0U) | (kSegmentBytes - count) << 1 |
                                    (last ? 1U : 0U)),
          now);
  std::memcpy(pending_.data.data() + 1, buffer_.data() + transferred_, count);
  transferred_ += count;
}

}  // namespace walkman::canopen
