#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <vector>

#include "drivers/time.h"

/// How a MultiSense's messages travel: in UDP datagrams with a header of 18 bytes each, which has the
/// sequence id of the message, its length and where in it the datagram's bytes belong. There is no
/// retransmission.
namespace walkman::multisense {

inline constexpr std::uint16_t kCommandPort = 9001;
inline constexpr std::size_t kDatagramHeadBytes = 18;
inline constexpr std::size_t kIpUdpHeadBytes = 28;          ///< of an MTU
inline constexpr std::size_t kMostDatagramBytes = 9000;     ///< the vendor's receive buffers
inline constexpr std::size_t kMostMessageBytes = 10 << 20;  ///< its client's limit
inline constexpr std::size_t kLeastMtu = 1500, kMostMtu = 9000;

struct DatagramHead {
  std::uint16_t sequence = 0;
  std::uint32_t message_bytes = 0;
  std::uint32_t offset = 0;
};

/// None for what is no datagram of this protocol.
[[nodiscard]] std::optional<DatagramHead> read_head(std::span<const std::uint8_t> datagram) noexcept;

/// Cuts a message into datagrams, one after the other.
class Fragments {
 public:
  /// `message` must live as long. `mtu` in bytes, IP and UDP headers included.
  Fragments(std::span<const std::uint8_t> message, std::uint16_t sequence, std::size_t mtu) noexcept;

  [[nodiscard]] bool done() const noexcept { return offset_ == message_.size(); }
  /// Writes the next one. Of a disparity image the first has the head alone, and every other one whole pairs
  /// of pixels.
  void next(std::vector<std::uint8_t>& datagram);

 private:
  std::span<const std::uint8_t> message_;
  std::uint16_t sequence_;
  std::size_t most_;   // bytes of a message in one datagram
  std::size_t first_;  // and in the first of them
  std::size_t offset_ = 0;
};

/// Puts messages together from datagrams in the order in which they come. A message whose beginning is
/// missing, or whose datagrams do not follow each other, is lost.
class Assembler {
 public:
  /// The message that this datagram completes, until the next call; empty while there is none.
  [[nodiscard]] std::span<const std::uint8_t> take(std::span<const std::uint8_t> datagram);

  /// Messages of which a part has not come.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Datagrams that were none of this protocol.
  [[nodiscard]] std::uint64_t strange() const noexcept { return strange_; }

 private:
  static constexpr std::size_t kMostUnfinished = 4;
  struct Unfinished {
    std::uint16_t sequence;
    std::size_t message_bytes;  // when it is whole
    std::vector<std::uint8_t> bytes;
  };

  std::list<Unfinished> unfinished_;  // oldest first
  std::vector<std::uint8_t> complete_;
  std::optional<std::uint16_t> given_up_;  // sequence id of the last message that was lost
  std::uint64_t lost_ = 0, strange_ = 0;
};

/// A client's end of a datagram connection to one device.
class DatagramPort {
 public:
  virtual ~DatagramPort() = default;

  /// A datagram that cannot be sent is lost, as on the way.
  virtual void send(std::span<const std::uint8_t> datagram) = 0;
  /// Takes the next datagram that has come; false when there is none.
  [[nodiscard]] virtual bool receive(std::vector<std::uint8_t>& datagram) = 0;
  /// Waits for a datagram, for at most so long on the host's clock; false when none has come.
  [[nodiscard]] virtual bool wait(Time limit) = 0;
};

}  // namespace walkman::multisense
