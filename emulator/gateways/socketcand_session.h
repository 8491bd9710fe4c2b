#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "emulator/gateways/broadcast_manager.h"
#include "emulator/gateways/controller_pool.h"
#include "emulator/gateways/socketcand_protocol.h"
#include "emulator/gateways/text_queue.h"

namespace walkman::gateways {

/// Totals over all clients of a server.
struct SocketcandCounters {
  std::uint64_t sent = 0;      ///< frames of clients that went to a bus
  std::uint64_t refused = 0;   ///< frames of clients that the bus could not take
  std::uint64_t received = 0;  ///< frames forwarded to clients
  std::uint64_t dropped = 0;   ///< frames for which a client was too slow
  std::uint64_t skipped = 0;   ///< remote frames, which the protocol cannot carry to a client
  std::uint64_t errors = 0;    ///< messages that were not understood
};

/// The conversation with one client of a socketcand server, without its socket: characters in, characters
/// out (doc/protocol.md of linux-can/socketcand; ISO-TP is not offered).
///
/// A client begins with `open`; any other beginning, and anything outside the brackets of a message at any
/// time, ends the connection, so that no browser can be made to talk to a bus. After `open` it is in mode
/// BCM, where it receives what it has requested with `subscribe`, `filter` and `muxfilter`; `rawmode`,
/// `bcmmode` and `controlmode` change the mode. Intervals are on the bus's clock.
///
/// Does what python-can 4.1.0 expects of a server. A reply in the handshake must be the only message that its
/// read returns, so frames are held back after the reply to rawmode until the client sends again or
/// `kHandshakePause` is over. The pause is counted in steps, so that a time in which the whole machine stood
/// still counts little. python-can reads 1024 characters at a time and loses the first character of a message
/// cut by that; so once that much has been written, every message is preceded by a line feed, which is lost
/// instead. The reference client skips to the next bracket, so this does not affect it.
class SocketcandSession {
 public:
  static constexpr std::size_t kQueueLength = 65536;
  static constexpr Time kHandshakeStep = std::chrono::milliseconds(50);
  static constexpr int kHandshakeSteps = 5;
  static constexpr Time kHandshakePause = kHandshakeSteps * kHandshakeStep;
  /// How long a client may take to open a bus, on the host's clock.
  static constexpr Time kOpenLimit = std::chrono::seconds(30);

  enum class Step {
    kNeedMore,  ///< all input is used up
    kDone,      ///< one message has been processed; there may be a reply to send
    kBlocked,   ///< the bus or the outgoing queue has no room; nothing was used up
    kClosed,    ///< the connection is to be closed, once the reply has been sent
  };

  /// Greets the client. Both must outlive the session. `wall` is the host's time, here and below.
  SocketcandSession(ControllerPool& pool, SocketcandCounters& counters, Time wall);
  ~SocketcandSession();
  SocketcandSession(const SocketcandSession&) = delete;
  SocketcandSession& operator=(const SocketcandSession&) = delete;

  /// Takes at most one message off the front of `input`. Opening a bus and requesting frames may allocate.
  [[nodiscard]] Step step(std::string_view& input, Time wall);

  /// Writes what came from the bus to the outgoing queue, and sends what is due on the bus. Frames that do
  /// not fit are dropped and counted.
  void forward(Time wall) noexcept;

  /// When `forward` must be called again for frames that are held back; Time::min() if none are.
  [[nodiscard]] Time held_until() const noexcept { return held_until_; }
  /// When the client is to be disconnected; Time::max() once it has opened a bus.
  [[nodiscard]] Time open_until() const noexcept { return open_until_; }

  [[nodiscard]] TextQueue& outgoing() noexcept { return outgoing_; }

 private:
  enum class Mode { kNoBus, kBcm, kRaw, kControl };

  [[nodiscard]] bool offer() noexcept;
  [[nodiscard]] bool held(Time wall) noexcept;
  [[nodiscard]] Step handle(const SocketcandCommand& command, Time wall);
  [[nodiscard]] Step begin(const SocketcandCommand& command);
  [[nodiscard]] bool enter(Mode mode, Time wall);
  [[nodiscard]] bool manage(const SocketcandCommand& command);
  [[nodiscard]] bool send(const can::Frame& frame) noexcept;
  void send_due() noexcept;
  void forward_statistics() noexcept;
  void reply(std::string_view message) noexcept { static_cast<void>(outgoing_.push(message)); }
  void refuse(std::string_view message) noexcept {
    ++counters_.errors;
    reply(message);
  }
  void write(const can::StampedFrame& frame) noexcept;

  /// The counters of a network interface.
  struct Traffic {
    std::uint64_t bytes = 0;
    std::uint64_t packets = 0;
    void count(const can::Frame& frame) noexcept {
      ++packets;
      if (!frame.remote) bytes += frame.length;
    }
  };

  ControllerPool& pool_;
  SocketcandCounters& counters_;
  ControllerPool::Attached attached_;
  Mode mode_ = Mode::kNoBus;
  SocketcandReader reader_;
  BroadcastManager manager_;
  TextQueue outgoing_{kQueueLength};
  std::optional<can::Frame> waiting_;  // for room in the bus's transmit queue
  int steps_held_ = 0;                 // steps left of the pause after the handshake
  Time held_until_ = Time::min();
  Time open_until_;
  std::uint64_t written_ = 0;  // characters of frames so far
  std::uint64_t overflows_ = 0;
  Traffic received_, transmitted_;
  Time statistics_interval_{};
  Time statistics_at_{};  // on the bus's clock
};

}  // namespace walkman::gateways
