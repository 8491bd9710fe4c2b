#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "emulator/bus/can_bus.h"
#include "emulator/gateways/text_queue.h"

namespace walkman::gateways {

struct SlcanCounters {
  std::uint64_t sent = 0;      ///< frames of the peer that went to the bus
  std::uint64_t refused = 0;   ///< frames of the peer for which the bus had no room
  std::uint64_t received = 0;  ///< frames forwarded to the peer
  std::uint64_t dropped = 0;   ///< frames for which the peer was too slow
  std::uint64_t skipped = 0;   ///< FD and error frames, which the protocol cannot carry
  std::uint64_t errors = 0;    ///< commands that were not understood or not allowed
};

/// A serial-line CAN adapter (slcan, after Lawicel AB's CAN232 and CANUSB) on an emulated bus, without its
/// serial line: characters in, characters out. Commands, each ended by a carriage return:
/// - S0..S8: 10, 20, 50, 100, 125, 250, 500, 800 (or 750), 1000 kbit/s; refused unless it is the bus's rate
/// - s...: bit timing registers; accepted and ignored
/// - O, L, C: open, open listen-only, close
/// - t, T, r, R: send a frame; answered with z or Z and a carriage return
/// - Z0, Z1: time stamps of received frames off, on
/// - V, N, F: version, serial number (derived from the bus's name), status flags
///
/// Answers end in a carriage return; a command that is wrong or not allowed is answered with a BEL.
///
/// Status flags: 01h receive queue full, 02h transmit queue full, 04h error warning, 08h data overrun, 20h
/// passive, 80h bus error. Those of the queues and of bus errors are cleared by reading. In bus-off, closing
/// and opening restarts the controller.
class SlcanAdapter {
 public:
  static constexpr std::size_t kQueueLength = 65536;
  static constexpr std::size_t kLongestCommand = 32;

  /// The bus must outlive the adapter. The adapter adds its own controller to it when it is first opened.
  explicit SlcanAdapter(bus::CanBus& bus) : bus_(bus) {}

  /// Takes what the peer has written, in pieces of any size, and answers. As on a serial line, answers that
  /// the peer does not read are lost. Opening allocates, once.
  void take(std::string_view input) noexcept;

  /// Writes frames received from the bus to the outgoing queue; those that do not fit are dropped and
  /// counted.
  void forward() noexcept;

  /// Returns to the state after power-up, because the peer has gone.
  void reset() noexcept;

  [[nodiscard]] TextQueue& outgoing() noexcept { return outgoing_; }
  [[nodiscard]] const SlcanCounters& counters() const noexcept { return counters_; }

 private:
  enum class Channel { kClosed, kOpen, kListening };

  void execute(std::string_view command) noexcept;
  [[nodiscard]] bool set_up(std::string_view command) noexcept;
  [[nodiscard]] bool open(Channel channel) noexcept;
  [[nodiscard]] bool transmit(std::string_view command) noexcept;
  void identify(char command) noexcept;
  void report_flags() noexcept;
  void answer(std::string_view text) noexcept { static_cast<void>(outgoing_.push(text)); }

  bus::CanBus& bus_;
  bus::ComputerPort* controller_ = nullptr;
  TextQueue outgoing_{kQueueLength};
  SlcanCounters counters_;
  std::array<char, kLongestCommand> command_;
  std::size_t size_ = 0;  // above kLongestCommand: too long, being skipped
  Channel channel_ = Channel::kClosed;
  bool stamps_ = false;
  std::uint8_t flags_ = 0;
  std::uint64_t overflows_ = 0;
};

}  // namespace walkman::gateways
