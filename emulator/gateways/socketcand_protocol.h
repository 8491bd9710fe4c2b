#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "drivers/can/frame.h"
#include "emulator/gateways/text_line.h"

namespace walkman::gateways {

/// Finds the messages "< ... >" in a client's stream of characters, which may come in pieces of any size.
/// Blanks between messages are ignored.
class SocketcandReader {
 public:
  static constexpr std::size_t kLongestMessage = 256;

  enum class Result {
    kNeedMore,  ///< all input is used up, no message is complete
    kMessage,   ///< `message` is what stood between the brackets
    kGarbage,   ///< characters outside brackets, or a bracket opened twice; told once, reading goes on
    kTooLong,   ///< more than kLongestMessage characters without an end, inside or outside brackets
  };

  /// Takes characters off the front of `input` up to the first thing worth telling.
  [[nodiscard]] Result read(std::string_view& input) noexcept;

  /// Valid after kMessage until the next call of `read`.
  [[nodiscard]] std::string_view message() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, kLongestMessage> text_;
  std::size_t size_ = 0;
  std::size_t garbage_ = 0;
  bool inside_ = false;
};

/// What a client asks for.
struct SocketcandCommand {
  enum class Kind {
    kOpen,       ///< `bus` is wanted
    kRawMode,    ///< every frame from now on
    kEcho,       ///< sign of life
    kSend,       ///< `frame` is to be sent
    kMalformed,  ///< a known command with wrong arguments
    kUnknown,
  };
  Kind kind = Kind::kUnknown;
  std::string_view bus;
  can::Frame frame;
};

/// Reads a message without its brackets. `send ID LENGTH BYTE...`: ID and bytes hexadecimal without prefix,
/// in either case and padded or not, LENGTH 0..8. An ID of eight digits or above 7FF is extended; bit 31
/// marks it as extended too. Negative numbers of 32 or 64 bits, as a client writes that takes bytes and
/// identifiers for signed ones, are read by their lowest bits.
[[nodiscard]] SocketcandCommand parse_socketcand(std::string_view message) noexcept;

/// "< frame 185 12.345678 3706E803 >", with the time in seconds; a frame without data keeps the blank before
/// its data: "< frame 080 12.345678  >". An error frame becomes "< error CLASS TIME >". False for FD and
/// remote frames, which the protocol has no message for.
[[nodiscard]] bool write_socketcand(const can::StampedFrame& frame, TextLine& out) noexcept;

}  // namespace walkman::gateways
