#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "emulator/gateways/end_pool.h"
#include "emulator/gateways/socketcand_protocol.h"
#include "emulator/gateways/text_queue.h"

namespace walkman::gateways {

struct SocketcandCounters {
  std::uint64_t sent = 0;      ///< frames of clients that went to a bus
  std::uint64_t refused = 0;   ///< frames of clients the bus could not take
  std::uint64_t received = 0;  ///< frames forwarded to clients
  std::uint64_t dropped = 0;   ///< frames a client was too slow for
  std::uint64_t skipped = 0;   ///< FD and remote frames, which the protocol cannot carry
  std::uint64_t errors = 0;    ///< messages that were not understood
};

/// The conversation with one client of a socketcand server, without its socket: characters in, characters
/// out. Understands open, rawmode, send and echo; anything else is answered with an error message.
///
/// It knows what python-can 4.1.0 expects of a server. A reply in the handshake must be the only message its
/// read returns, so frames are held back after the reply to rawmode until the client speaks again or
/// `kHandshakePause` is over, in steps, so that a time in which the whole machine stood still counts little.
/// It reads 1024 characters at a time, and of a message cut by that it loses the first one; so once that much
/// has been written, every message is preceded by a line feed, which is lost instead. The reference client
/// skips to the next bracket, so this is nothing to it.
class SocketcandSession {
 public:
  static constexpr std::size_t kQueueLength = 65536;
  static constexpr Time kHandshakeStep = std::chrono::milliseconds(50);
  static constexpr int kHandshakeSteps = 5;
  static constexpr Time kHandshakePause = kHandshakeSteps * kHandshakeStep;

  enum class Step {
    kNeedMore,  ///< all input is used up
    kDone,      ///< one message has been dealt with; there may be a reply to send
    kBlocked,   ///< the bus or the outgoing queue has no room; nothing was used up
    kClosed,    ///< the connection is to be closed
  };

  /// Greets. Both must outlive the session.
  SocketcandSession(EndPool& pool, SocketcandCounters& counters);
  ~SocketcandSession();
  SocketcandSession(const SocketcandSession&) = delete;
  SocketcandSession& operator=(const SocketcandSession&) = delete;

  /// Takes at most one message off the front of `input`. `wall` is the host's time. Opening a bus may
  /// allocate.
  [[nodiscard]] Step step(std::string_view& input, Time wall) noexcept;

  /// Writes frames received from the bus to the outgoing queue; those without room are dropped and counted.
  void forward(Time wall) noexcept;

  /// When `forward` has to be called again for frames that are held back; Time::min() when none are.
  [[nodiscard]] Time held_until() const noexcept { return held_until_; }

  [[nodiscard]] TextQueue& outgoing() noexcept { return outgoing_; }

 private:
  [[nodiscard]] bool offer() noexcept;
  [[nodiscard]] bool held(Time wall) noexcept;
  void handle(const SocketcandCommand& command, Time wall) noexcept;
  void open(std::string_view bus) noexcept;
  void reply(std::string_view message) noexcept { static_cast<void>(outgoing_.push(message)); }
  void refuse(std::string_view message) noexcept {
    ++counters_.errors;
    reply(message);
  }
  void write(const can::StampedFrame& frame) noexcept;

  EndPool& pool_;
  SocketcandCounters& counters_;
  bus::ComputerPort* end_ = nullptr;
  SocketcandReader reader_;
  TextQueue outgoing_{kQueueLength};
  std::optional<can::Frame> waiting_;  // for room in the bus's transmit queue
  bool raw_ = false;
  int steps_held_ = 0;  // left of the pause after the handshake
  Time held_until_ = Time::min();
  std::uint64_t written_ = 0;  // characters of frames
  std::uint64_t overflows_ = 0;
};

}  // namespace walkman::gateways
