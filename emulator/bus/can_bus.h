#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/can/interface.h"
#include "emulator/bus/attempt.h"
#include "emulator/bus/computer_port.h"
#include "emulator/bus/controller.h"
#include "emulator/bus/load_meter.h"
#include "emulator/bus/participant.h"
#include "emulator/bus/sync_watch.h"

namespace walkman::bus {

/// How a bus is wired and clocked.
struct BusOptions {
  std::uint32_t bit_rate = 1'000'000;       ///< nominal, bit/s
  bool fd = false;                          ///< carries CAN FD frames with bit-rate switch as well
  std::uint32_t data_bit_rate = 5'000'000;  ///< of the data phase of FD frames, bit/s
  /// False: a frame sent successfully takes no time; the order is still that of arbitration. A failed
  /// attempt, and every frame after 8192 at one instant, still takes its time, so that time advances.
  bool timing = true;
};

struct BusCounters {
  std::uint64_t frames = 0;              ///< sent successfully, lost ones included
  std::uint64_t lost = 0;                ///< of these, removed from the wire by the filter or a fault
  std::uint64_t busy_bits = 0;           ///< bit times used: frames, stuff bits, error frames, intermission
  Time busy{};                           ///< the same as time; with timing off, what it would have been
  std::uint64_t error_frames = 0;        ///< attempts that ended in an error frame
  std::uint64_t given_up = 0;            ///< frames not sent again: one-shot, or dropped in bus-off
  std::uint64_t transmit_overflows = 0;  ///< frames for which a participant's transmit queue had no room
  std::uint64_t sync_overruns = 0;       ///< SYNC cycles that did not fit, as determined by SyncWatch
  Time longest_sync_cycle{};             ///< longest time from a SYNC until the bus was free
};

/// Error counters of a participant's controller, and its state.
struct ErrorCounters {
  int transmit = 0;
  int receive = 0;
  can::LinkState state = can::LinkState::kActive;
};

/// One CAN bus as a discrete-event model, deterministic to the nanosecond.
///
/// Whenever the bus is idle, the frames at the head of every participant's transmit queue arbitrate by
/// identifier; the winner occupies the bus for its exact length at the bit rate. All other participants
/// receive it at the end of its end-of-frame field, which is also the instant it is stamped with; the next
/// arbitration follows the intermission, 3 bits later.
///
/// Every participant has a controller with error counters. A frame with a bit error or without an
/// acknowledgement ends in an error frame and is sent again; an error-passive sender waits 8 bits longer, one
/// in bus-off is off the bus until it restarts. Two participants that offer the same identifier at once send
/// together: equal frames merge, different ones cause a bit error where they differ.
///
/// Timers of participants run when they are due, before an arbitration at the same instant.
class CanBus {
 public:
  using Observer = std::function<void(const can::StampedFrame&)>;
  using Filter = std::function<bool(can::Frame&, Time)>;
  using FaultPort = std::function<FrameFate(const can::Frame&, Time)>;

  /// `name`: name of the limb ("rarm"). `interface_name`: name of the network interface that the bus stands
  /// for ("can_rarm"). Throws std::runtime_error for a bit rate outside 10 kbit/s .. 1 Mbit/s, or a data bit
  /// rate below the bit rate or above 8 Mbit/s.
  CanBus(std::string name, std::string interface_name, const BusOptions& options = {});

  /// Adds a participant, which must outlive the bus. Not to be called between calls of `advance` in cyclic
  /// operation: allocates.
  void attach(Participant& participant);

  /// The computer's port. Frames sent here take part in arbitration from `now` on.
  [[nodiscard]] ComputerPort& computer_port() noexcept { return computer_; }

  /// Adds one more computer to the bus, for a tool; its port lives as long as the bus. Allocates.
  [[nodiscard]] ComputerPort& add_port();

  /// Disconnects or reconnects the cable of an attached participant, from the next frame on. A participant
  /// without a bus sends to nobody and receives nothing.
  void cut(const Participant& participant) noexcept { set_cut(participant, true); }
  void reconnect(const Participant& participant) noexcept { set_cut(participant, false); }

  /// Returns everything with a controller on the bus, the computer first. Allocates.
  [[nodiscard]] std::vector<Participant*> participants() const;

  /// Runs all events up to and including `until`; does nothing if `until` is before `now`.
  void advance(Time until) noexcept;

  [[nodiscard]] Time now() const noexcept { return now_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::string_view interface_name() const noexcept { return computer_.name(); }
  [[nodiscard]] std::uint32_t bit_rate() const noexcept { return options_.bit_rate; }
  [[nodiscard]] const BusOptions& options() const noexcept { return options_; }
  /// Whether nothing is under way and nobody has anything to send.
  [[nodiscard]] bool quiet() const noexcept;
  /// Time of the next event that needs no input: a frame ends, a participant's timer runs. Time::max() if
  /// none.
  [[nodiscard]] Time next_event() const noexcept;

  /// Sets the observer, called with every frame that is complete and not lost, and with the error reports of
  /// the computer's port, if it makes any. Must not throw.
  void set_observer(Observer observer) { observer_ = std::move(observer); }

  /// Sets the filter, called at the end of every frame. If it returns false, no receiver gets the frame, and
  /// its sender notices nothing. Receivers get the frame as altered by the filter, as if it had been
  /// corrupted after their CRC check. Must not throw.
  void set_filter(Filter filter) { filter_ = std::move(filter); }

  /// Sender of the frame that has just ended; for the filter.
  [[nodiscard]] const Participant& sender() const noexcept { return *controllers_[sender_].participant; }
  /// Delivers a frame of `sender` to all others at once, bypassing the wire: one that a controller or a
  /// gateway in between held back or duplicated.
  void hand_over(const can::Frame& frame, const Participant& sender) noexcept;

  /// Sets the fault port, called at the start of every attempt to send a frame, with its start time: decides
  /// what happens to it. Must not throw.
  void set_fault_port(FaultPort port) { fault_port_ = std::move(port); }

  [[nodiscard]] BusCounters counters() const noexcept;
  /// Counters of an attached participant; zeros for any other.
  [[nodiscard]] ErrorCounters error_counters(const Participant& participant) const noexcept;

  /// Share of the last second for which the bus was busy, 0..1.
  [[nodiscard]] double load() noexcept { return load_.load(now_); }
  /// The same over the last 20 ms, in whole steps of 10 ms.
  [[nodiscard]] double recent_load() noexcept { return load_.recent_load(now_); }

 private:
  enum class Phase { kIdle, kFrame, kInterframe };

  [[nodiscard]] Time time_of(const WireLength& length) const noexcept {
    return duration(length, options_.bit_rate, options_.data_bit_rate);
  }
  [[nodiscard]] Time bit_time(int bits) const noexcept { return time_of({bits, 0}); }
  void refresh(Controller& controller) noexcept {
    controller.refresh();
    earliest_ = std::min(earliest_, controller.due);
  }
  void run_timers() noexcept;

  // One frame: arbitration and planning, and its end.
  [[nodiscard]] bool start_frame() noexcept;
  [[nodiscard]] std::size_t arbitrate(bool& several) noexcept;
  void end_frame() noexcept;
  void succeed() noexcept;
  void deliver() noexcept;

  // How controllers react to an attempt that failed.
  void fail() noexcept;
  void settle_failed_sender(Controller& controller) noexcept;
  void settle_failed_receiver(Controller& controller) noexcept;
  void state_changed(Controller& controller) noexcept;
  void report_bus_error(Controller& controller, const BusError& error) noexcept;
  void report(Controller& controller, const can::Frame& frame) noexcept;
  void suspend_if_passive(Controller& controller) noexcept;

  // Controllers that do not take part normally: suspended, in bus-off, cut off.
  void set_cut(const Participant& participant, bool cut) noexcept;
  [[nodiscard]] Time next_exception() const noexcept;
  void run_exceptions() noexcept;
  void run_bus_off(Controller& controller) noexcept;
  void run_alone(Controller& controller) noexcept;
  [[nodiscard]] Time recovered_at(const Controller& controller) const noexcept;
  void dominant_again() noexcept;
  void recessive_again() noexcept;

  std::string name_;
  BusOptions options_;
  ComputerPort computer_;
  std::vector<std::unique_ptr<ComputerPort>> tools_;
  std::vector<Controller> controllers_;
  Observer observer_;
  Filter filter_;
  FaultPort fault_port_;

  Time now_{};
  Time earliest_{};  // no participant's event is due before this
  Phase phase_ = Phase::kIdle;
  Time phase_ends_{};
  std::size_t sender_ = 0;  // of the frame under way; the first one if several send it
  Attempt attempt_;
  Time recessive_since_{};   // outside a frame
  bool exceptions_ = false;  // a controller may be suspended, in bus-off or cut off
  int timeless_frames_ = 0;  // at this instant

  BusCounters counters_;
  LoadMeter load_;
  SyncWatch sync_watch_;
};

}  // namespace walkman::bus
