#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <vector>

#include "drivers/time.h"

/// Transport of a MultiSense's messages: UDP datagrams, each with an 18-byte header that holds the sequence
/// id of the message, its length and the offset in it at which the datagram's bytes belong. There is no
/// retransmission.
namespace walkman::multisense {

inline constexpr std::uint16_t kCommandPort = 9001;
inline constexpr std::size_t kDatagramHeadBytes = 18;
inline constexpr std::size_t kIpUdpHeadBytes = 28;          ///< part of the MTU
inline constexpr std::size_t kMostDatagramBytes = 9000;     ///< size of the vendor's receive buffers
inline constexpr std::size_t kMostMessageBytes = 10 << 20;  ///< limit of the vendor's client
inline constexpr std::size_t kLeastMtu = 1500, kMostMtu = 9000;

struct DatagramHead {
  std::uint16_t sequence = 0;
  std::uint32_t message_bytes = 0;
  std::uint32_t offset = 0;
};

/// Returns nullopt if this is not a datagram of this protocol.
[[nodiscard]] std::optional<DatagramHead> read_head(std::span<const std::uint8_t> datagram) noexcept;

/// Splits a message into datagrams, one after the other.
class Fragments {
 public:
  /// `message` must outlive this object. `mtu`: bytes, including the IP and UDP headers.
  Fragments(std::span<const std::uint8_t> message, std::uint16_t sequence, std::size_t mtu) noexcept;

  [[nodiscard]] bool done() const noexcept { return offset_ == message_.size(); }
  /// Writes the next datagram. For a disparity image, the first one contains only the image's header, and
  /// every other one whole pairs of pixels.
  void next(std::vector<std::uint8_t>& datagram);

 private:
  std::span<const std::uint8_t> message_;
  std::uint16_t sequence_;
  std::size_t most_;   // bytes of the message per datagram
  std::size_t first_;  // bytes in the first datagram
  std::size_t offset_ = 0;
};

/// Assembles messages from datagrams in order of arrival. A message whose beginning is missing, or whose
/// datagrams are not consecutive, is lost. A datagram that the network delivers twice has no effect the
/// second time, unless it is a whole message.
class Assembler {
 public:
  /// Returns the message that this datagram completes, valid until the next call; empty if it completes none.
  [[nodiscard]] std::span<const std::uint8_t> take(std::span<const std::uint8_t> datagram);

  /// Number of messages of which a part did not arrive.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Number of datagrams that did not belong to this protocol.
  [[nodiscard]] std::uint64_t strange() const noexcept { return strange_; }

 private:
  static constexpr std::size_t kMostUnfinished = 4;
  struct Unfinished {
    std::uint16_t sequence;
    std::size_t message_bytes;  // of the complete message
    std::vector<std::uint8_t> bytes;
  };

  std::list<Unfinished> unfinished_;  // oldest first
  std::vector<std::uint8_t> complete_;
  std::array<std::optional<std::uint16_t>, kMostUnfinished> finished_;  // sequence ids of the newest
  std::size_t next_finished_ = 0;
  std::optional<std::uint16_t> given_up_;  // sequence id of the last message that was lost
  std::uint64_t lost_ = 0, strange_ = 0;
};

/// Client end of a datagram connection to one device.
class DatagramPort {
 public:
  virtual ~DatagramPort() = default;

  /// Sends a datagram. One that cannot be sent is lost, as if in transit.
  virtual void send(std::span<const std::uint8_t> datagram) = 0;
  /// Takes the next received datagram; returns false if there is none.
  [[nodiscard]] virtual bool receive(std::vector<std::uint8_t>& datagram) = 0;
  /// Waits for a datagram, at most for `limit` on the host's clock; returns false if none arrives.
  [[nodiscard]] virtual bool wait(Time limit) = 0;
};

}  // namespace walkman::multisense
