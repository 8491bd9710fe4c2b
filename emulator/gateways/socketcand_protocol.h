#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/can/frame.h"
#include "emulator/gateways/text_line.h"

namespace walkman::gateways {

/// Finds the messages "< ... >" in a client's stream of characters, which may arrive in pieces of any size.
/// Blanks between messages are ignored.
class SocketcandReader {
 public:
  static constexpr std::size_t kLongestMessage = 8192;  ///< a `muxfilter` of 257 tuples fits

  enum class Result {
    kNeedMore,  ///< all input is used up, no message is complete
    kMessage,   ///< `message` is the text between the brackets
    kGarbage,   ///< characters outside brackets, a bracket opened twice, or a message that is too long
  };

  /// Takes characters off the front of `input` up to the first result to report.
  [[nodiscard]] Result read(std::string_view& input) noexcept;

  /// Valid after kMessage until the next call of `read`.
  [[nodiscard]] std::string_view message() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, kLongestMessage> text_;
  std::size_t size_ = 0;
  bool inside_ = false;
};

/// A client's request. Identifiers without content are in `frame`, too.
struct SocketcandCommand {
  enum class Kind {
    kOpen,         ///< open `bus`
    kRawMode,      ///< pass on every frame from now on
    kBcmMode,      ///< pass on only requested frames
    kControlMode,  ///< no frames; statistics
    kEcho,         ///< sign of life
    kSend,         ///< send `frame`
    kSendFd,       ///< the same, a CAN FD frame
    kAdd,          ///< send `frame` at every `interval`
    kUpdate,       ///< new content for the frame sent at intervals
    kDelete,       ///< stop sending it
    kSubscribe,    ///< pass on frames like `frame`, at most one per `interval`
    kFilter,       ///< the same, if the content under the first of `masks` has changed
    kMuxFilter,    ///< the same for multiplexed content
    kUnsubscribe,  ///< stop passing them on
    kStatistics,   ///< counters, one message per `interval`; zero: none
    kMalformed,    ///< a known command with wrong arguments
    kUnknown,
  };
  using Mask = std::array<std::uint8_t, 8>;

  Kind kind = Kind::kUnknown;
  std::string_view bus;
  can::Frame frame;
  Time interval{};
  std::vector<Mask> masks;
};

/// Reads a message without its brackets (doc/protocol.md of linux-can/socketcand, and what its server does).
/// Identifiers and bytes are hexadecimal without prefix, in either case and padded or not; lengths and
/// intervals decimal. An identifier of eight digits or above 7FF is extended; bits 31 and 30 are SocketCAN's
/// flags for extended and remote frames. Negative numbers of 32 or 64 bits, as written by a client that
/// treats bytes and identifiers as signed, are reduced to their lowest bits. Allocates only for `filter` and
/// `muxfilter`.
[[nodiscard]] SocketcandCommand parse_socketcand(std::string_view message);

/// How the bytes of a received frame are written: as in mode RAW, "3706E803", or in mode BCM, "37 06 E8 03 ".
enum class SocketcandData { kTogether, kApart };

/// "< frame 185 12.345678 3706E803 >", with the time in seconds; a frame without data keeps the blank before
/// its data: "< frame 080 12.345678  >". An FD frame becomes "< fdframe ID FLAGS TIME DATA >" with the flags
/// of linux/can.h, an error frame "< error CLASS TIME >". Returns false for remote frames, for which the
/// protocol has no message.
[[nodiscard]] bool write_socketcand(const can::StampedFrame& frame, SocketcandData data,
                                    TextLine& out) noexcept;

}  // namespace walkman::gateways
