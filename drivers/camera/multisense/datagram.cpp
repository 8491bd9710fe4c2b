#include "drivers/camera/multisense/datagram.h"

#include <algorithm>

#include "drivers/camera/multisense/messages.h"
#include "drivers/camera/multisense/wire.h"

namespace walkman::multisense {
namespace {

constexpr std::uint16_t kMagic = 0xADAD, kProtocol = 0x0100, kGroup = 0x0001;
constexpr std::size_t kPairBytes = 3;  // two pixels of 12 bits

using canopen::get;
using canopen::put;

}  // namespace

std::optional<DatagramHead> read_head(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() < kDatagramHeadBytes || datagram.size() > kMostDatagramBytes) return std::nullopt;
  const std::uint8_t* const p = datagram.data();
  if (get<std::uint16_t>(p) != kMagic || get<std::uint16_t>(p + 2) != kProtocol ||
      get<std::uint16_t>(p + 4) != kGroup)
    return std::nullopt;
  const DatagramHead head{get<std::uint16_t>(p + 8), get<std::uint32_t>(p + 10), get<std::uint32_t>(p + 14)};
  const std::size_t bytes = datagram.size() - kDatagramHeadBytes;
  if (head.message_bytes < kMessageHeadBytes || head.message_bytes > kMostMessageBytes ||
      head.offset > head.message_bytes || bytes > head.message_bytes - head.offset)
    return std::nullopt;
  return head;
}

Fragments::Fragments(std::span<const std::uint8_t> message, std::uint16_t sequence, std::size_t mtu) noexcept
    : message_(message),
      sequence_(sequence),
      most_(std::min(std::clamp(mtu, kLeastMtu, kMostMtu) - kIpUdpHeadBytes, kMostDatagramBytes) -
            kDatagramHeadBytes),
      first_(most_) {
  if (id_of(message) != Disparity::kId) return;
  most_ -= most_ % kPairBytes;
  first_ = Disparity::kHeadBytes;
}

void Fragments::next(std::vector<std::uint8_t>& datagram) {
  const std::size_t bytes = std::min(offset_ == 0 ? first_ : most_, message_.size() - offset_);
  datagram.resize(kDatagramHeadBytes + bytes);
  std::uint8_t* const p = datagram.data();
  put(p, kMagic);
  put(p + 2, kProtocol);
  put(p + 4, kGroup);
  put(p + 6, std::uint16_t{0});
  put(p + 8, sequence_);
  put(p + 10, static_cast<std::uint32_t>(message_.size()));
  put(p + 14, static_cast<std::uint32_t>(offset_));
  std::copy_n(message_.begin() + static_cast<std::ptrdiff_t>(offset_), bytes, p + kDatagramHeadBytes);
  offset_ += bytes;
}

std::span<const std::uint8_t> Assembler::take(std::span<const std::uint8_t> datagram) {
  const auto head = read_head(datagram);
  if (!head) {
    ++strange_;
    return {};
  }
  const std::span<const std::uint8_t> payload = datagram.subspan(kDatagramHeadBytes);
  const auto same = std::find_if(unfinished_.begin(), unfinished_.end(), [&](const Unfinished& message) {
    return message.sequence == head->sequence;
  });
  const bool single = head->offset == 0 && payload.size() == head->message_bytes;
  if (!single && std::find(finished_.begin(), finished_.end(), head->sequence) != finished_.end()) return {};
  if (head->offset == 0) {
    if (same != unfinished_.end()) {
      if (same->message_bytes == head->message_bytes && same->bytes.size() >= payload.size() &&
          std::equal(payload.begin(), payload.end(), same->bytes.begin()))
        return {};  // the same datagram once more
      ++lost_;
      unfinished_.erase(same);
    }
    if (single) return payload;
    if (unfinished_.size() == kMostUnfinished) {
      ++lost_;
      unfinished_.pop_front();
    }
    unfinished_.push_back({head->sequence, head->message_bytes, {}});
    std::vector<std::uint8_t>& bytes = unfinished_.back().bytes;
    bytes.swap(complete_);  // reuses its memory
    // Filled as the rest arrives: of ten announced megabytes only what was received is ever written to.
    bytes.assign(payload.begin(), payload.end());
    bytes.reserve(head->message_bytes);
    return {};
  }
  if (same == unfinished_.end()) {
    if (given_up_ != head->sequence) ++lost_;
    given_up_ = head->sequence;
    return {};
  }
  if (head->message_bytes == same->message_bytes && head->offset + payload.size() <= same->bytes.size())
    return {};  // a datagram that has arrived before
  if (head->offset != same->bytes.size() || head->message_bytes != same->message_bytes) {
    ++lost_;
    given_up_ = head->sequence;
    unfinished_.erase(same);
    return {};
  }
  same->bytes.insert(same->bytes.end(), payload.begin(), payload.end());
  if (same->bytes.size() < same->message_bytes) return {};
  complete_.swap(same->bytes);
  finished_[next_finished_++ % finished_.size()] = head->sequence;
  unfinished_.erase(same);
  return complete_;
}

}  // namespace walkman::multisense
