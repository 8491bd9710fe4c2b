#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "drivers/can/interface.h"
#include "emulator/bus/participant.h"

namespace walkman::bus {

/// First-in first-out queue of fixed capacity; all memory is allocated at construction.
template <typename T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : slots_(capacity) {}

  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] const T& front() const noexcept { return slots_[head_]; }

  /// Returns false if full; the value is then not stored.
  [[nodiscard]] bool push(const T& value) noexcept {
    if (size_ == slots_.size()) return false;
    std::size_t tail = head_ + size_;
    if (tail >= slots_.size()) tail -= slots_.size();
    slots_[tail] = value;
    ++size_;
    return true;
  }

  void pop() noexcept {
    head_ = head_ + 1 == slots_.size() ? 0 : head_ + 1;
    --size_;
  }

 private:
  std::vector<T> slots_;
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

/// Which error frames a computer's controller puts into its receive queue.
enum class ErrorReports {
  kNone,    ///< none: state and counters are read from `link` only
  kStates,  ///< warning, passive, active again, bus-off, restarted
  kAll,     ///< these, and every error on the bus (`berr-reporting on`)
};

/// Options that `ip link` sets on a Linux machine.
struct ControllerOptions {
  ErrorReports reports = ErrorReports::kNone;
  Time restart_after{};   ///< delay from bus-off to restart (restart-ms); zero: only by `restart`
  bool one_shot = false;  ///< a frame that failed is not sent again
};

/// State of the computer's side of a controller, and what may be wrong there.
enum class HostSide {
  kSound,
  kDown,      ///< the interface is down
  kFull,      ///< the transmit queue is full and does not empty
  kDeserted,  ///< the sending program is gone: frames still sent go nowhere
};

/// A computer's CAN controller on an emulated bus: a participant on the wire's side, a `can::Interface` on
/// the computer's. As with SocketCAN, its transmit queue is first-in first-out: only the oldest frame takes
/// part in arbitration. Its link is error-active when a computer powers on, then follows its error counters.
class ComputerPort final : public Participant, public can::Interface {
 public:
  static constexpr std::size_t kQueueLength = 4096;

  /// `fd`: the controller sends CAN FD frames too.
  explicit ComputerPort(std::string name, bool fd = false)
      : name_(std::move(name)), fd_(fd), transmit_(kQueueLength), receive_(kQueueLength) {}

  void configure(const ControllerOptions& options) noexcept { options_ = options; }
  [[nodiscard]] const ControllerOptions& options() const noexcept { return options_; }

  /// Takes effect at once. Down discards what is queued in both directions.
  void set_host_side(HostSide host) noexcept;

  /// Leaves bus-off: asks the controller to return to the bus. No effect in any other state.
  void restart() noexcept { restart_ = state_ == can::LinkState::kBusOff; }

  /// Returns kInvalid for an FD frame on a classical bus, a payload length without a code, an identifier too
  /// long, or an error report; kInterfaceDown in bus-off, or when down.
  [[nodiscard]] can::SendResult send(const can::Frame& frame) noexcept override;
  [[nodiscard]] bool receive(can::StampedFrame& out) noexcept override;
  /// Number of frames that wait to be sent.
  [[nodiscard]] std::size_t queued() const noexcept { return transmit_.size(); }
  [[nodiscard]] can::LinkState link() const noexcept override {
    return host_ == HostSide::kDown ? can::LinkState::kDown : state_;
  }
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override { return receive_overflows_; }
  [[nodiscard]] std::string_view name() const noexcept override { return name_; }

  void receive(const can::Frame& frame, Time now) noexcept override;
  void advance(Time now) noexcept override;
  [[nodiscard]] Time next_event() const noexcept override { return restart_at_; }
  [[nodiscard]] const can::Frame* pending() const noexcept override {
    return transmit_.empty() ? nullptr : &transmit_.front();
  }
  void take() noexcept override { transmit_.pop(); }
  /// Bus-off discards what is queued for transmission.
  void on_link_state(can::LinkState state, Time now) noexcept override;
  [[nodiscard]] bool one_shot() const noexcept override { return options_.one_shot; }
  [[nodiscard]] bool restarts() const noexcept override { return restart_; }
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept override { return transmit_overflows_; }

 private:
  std::string name_;
  bool fd_;
  ControllerOptions options_;
  Ring<can::Frame> transmit_;
  Ring<can::StampedFrame> receive_;
  can::LinkState state_ = can::LinkState::kActive;
  HostSide host_ = HostSide::kSound;
  bool restart_ = false;
  Time restart_at_ = Time::max();
  std::uint64_t transmit_overflows_ = 0;
  std::uint64_t receive_overflows_ = 0;
};

}  // namespace walkman::bus
