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
  /// False: a frame that goes through takes no time; order stays that of arbitration. A failed attempt, and
  /// every frame after 8192 at one instant, takes its time nevertheless, so that time goes on.
  bool timing = true;
};

struct BusCounters {
  std::uint64_t frames = 0;              ///< through, lost ones included
  std::uint64_t lost = 0;                ///< of these, taken off the wire by the filter or a fault
  std::uint64_t busy_bits = 0;           ///< bit times used: frames, stuff bits, error frames, intermission
  Time busy{};                           ///< the same as time; with timing off, what they would have taken
  std::uint64_t error_frames = 0;        ///< attempts that ended in an error frame
  std::uint64_t given_up = 0;            ///< frames not sent again: one-shot, or dropped in bus-off
  std::uint64_t transmit_overflows = 0;  ///< frames no participant's transmit queue had room for
  std::uint64_t sync_overruns = 0;       ///< SYNC cycles that did not fit, as SyncWatch says
  Time longest_sync_cycle{};             ///< longest time from a SYNC until the bus was free
};

/// What a participant's controller counts, and its state.
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
/// Every participant has a controller with error counters. A frame that meets a bit error or no
/// acknowledgement ends in an error frame and is sent again; a sender in error-passive waits 8 bits more, one
/// in bus-off is off the bus until it restarts. Two participants that offer the same identifier at once send
/// together: equal frames merge, different ones meet a bit error where they differ.
///
/// Timers of participants run at their own time, before an arbitration at the same instant.
class CanBus {
 public:
  using Observer = std::function<void(const can::StampedFrame&)>;
  using Filter = std::function<bool(can::Frame&, Time)>;
  using FaultPort = std::function<FrameFate(const can::Frame&, Time)>;

  /// `name` is the limb's ("rarm"), `interface_name` that of the network interface it stands for
  /// ("can_rarm"). Throws std::runtime_error for a bit rate outside 10 kbit/s .. 1 Mbit/s, or a data bit rate
  /// below the bit rate or above 8 Mbit/s.
  CanBus(std::string name, std::string interface_name, const BusOptions& options = {});

  /// Adds a participant, which must outlive the bus. Not between calls of `advance` in cyclic operation:
  /// allocates.
  void attach(Participant& participant);

  /// The computer's port. What is sent here takes part in arbitration from `now` on.
  [[nodiscard]] ComputerPort& computer_port() noexcept { return computer_; }

  /// One more computer on the bus, for a tool; lives as long as the bus. Allocates.
  [[nodiscard]] ComputerPort& add_port();

  /// Takes an attached participant's cable off, or plugs it in again; from the next frame on. A participant
  /// without a bus sends to nobody and hears nothing.
  void cut(const Participant& participant) noexcept { set_cut(participant, true); }
  void reconnect(const Participant& participant) noexcept { set_cut(participant, false); }

  /// Everything with a controller on the bus, the computer first. Allocates.
  [[nodiscard]] std::vector<Participant*> participants() const;

  /// Lets everything happen up to and including `until`; earlier times than `now` do nothing.
  void advance(Time until) noexcept;

  [[nodiscard]] Time now() const noexcept { return now_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::string_view interface_name() const noexcept { return computer_.name(); }
  [[nodiscard]] std::uint32_t bit_rate() const noexcept { return options_.bit_rate; }
  [[nodiscard]] const BusOptions& options() const noexcept { return options_; }
  /// Nothing is under way and nobody has anything to send.
  [[nodiscard]] bool quiet() const noexcept;
  /// When something happens next of itself: a frame ends, a participant's timer runs. Time::max() if never.
  [[nodiscard]] Time next_event() const noexcept;

  /// Called with every frame that is complete and not lost, and with the error reports of the computer's port
  /// if it makes any. Must not throw.
  void set_observer(Observer observer) { observer_ = std::move(observer); }

  /// Called at the end of every frame; false loses it for all receivers, its sender notices nothing. What it
  /// alters is what they get, as if it had gone wrong behind their CRC check. Must not throw.
  void set_filter(Filter filter) { filter_ = std::move(filter); }

  /// Of the frame that has just ended: to be asked by the filter.
  [[nodiscard]] const Participant& sender() const noexcept { return *controllers_[sender_].participant; }
  /// Gives a frame of `sender` to all others at once, without the wire: what a controller or a gateway
  /// between held back, or has twice.
  void hand_over(const can::Frame& frame, const Participant& sender) noexcept;

  /// Called at the start of every attempt to send a frame, with its start: decides what becomes of it. Must
  /// not throw.
  void set_fault_port(FaultPort port) { fault_port_ = std::move(port); }

  [[nodiscard]] BusCounters counters() const noexcept;
  /// Of an attached participant; zeros for any other.
  [[nodiscard]] ErrorCounters error_counters(const Participant& participant) const noexcept;

  /// Share of the last second the bus was busy, 0..1.
  [[nodiscard]] double load() noexcept { return load_.load(now_); }
  /// The same over the last 20 ms, in whole steps of 10.
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

  // One frame: arbitration and plan, its end.
  [[nodiscard]] bool start_frame() noexcept;
  [[nodiscard]] std::size_t arbitrate(bool& several) noexcept;
  void end_frame() noexcept;
  void succeed() noexcept;
  void deliver() noexcept;

  // What controllers make of an attempt that failed.
  void fail() noexcept;
  void settle_failed_sender(Controller& controller) noexcept;
  void settle_failed_receiver(Controller& controller) noexcept;
  void state_changed(Controller& controller) noexcept;
  void report_bus_error(Controller& controller, const BusError& error) noexcept;
  void report(Controller& controller, const can::Frame& frame) noexcept;
  void suspend_if_passive(Controller& controller) noexcept;

  // Controllers that are not simply there: suspended, in bus-off, cut off.
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
  Time earliest_{};  // no participant's event is due before
  Phase phase_ = Phase::kIdle;
  Time phase_ends_{};
  std::size_t sender_ = 0;  // of the frame under way; the first of them if several send it
  Attempt attempt_;
  Time recessive_since_{};   // outside a frame
  bool exceptions_ = false;  // a controller may be suspended, in bus-off or cut off
  int timeless_frames_ = 0;  // at this instant

  BusCounters counters_;
  LoadMeter load_;
  SyncWatch sync_watch_;
};

}  // namespace walkman::bus
