#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/can/interface.h"
#include "emulator/bus/computer_end.h"
#include "emulator/bus/load_meter.h"
#include "emulator/bus/participant.h"

namespace walkman::bus {

/// How a bus is wired and clocked.
struct BusOptions {
  std::uint32_t bit_rate = 1'000'000;       ///< nominal, bit/s
  bool fd = false;                          ///< carries CAN FD frames with bit-rate switch as well
  std::uint32_t data_bit_rate = 5'000'000;  ///< of the data phase of FD frames, bit/s
  bool timing = true;  ///< false: every frame takes no time; order stays that of arbitration
};

struct BusCounters {
  std::uint64_t frames = 0;              ///< complete on the wire, lost ones included
  std::uint64_t lost = 0;                ///< of these, taken off the wire by the filter
  std::uint64_t busy_bits = 0;           ///< bit times used, with stuff bits and intermission
  std::uint64_t transmit_overflows = 0;  ///< frames no participant's transmit queue had room for
};

/// One classical CAN bus as a discrete-event model, deterministic to the nanosecond.
///
/// Whenever the bus is idle, the frames at the head of every participant's transmit queue arbitrate by
/// identifier; the winner occupies the bus for its exact length at the bit rate. All other participants
/// receive it at the end of its end-of-frame field, which is also the instant it is stamped with; the next
/// arbitration follows the intermission, 3 bits later. Two participants that offer the same identifier at
/// once are served in the order they were attached, the computer first: a real bus would raise a bit error if
/// their data differ.
///
/// Timers of participants run at their own time, before an arbitration at the same instant.
class CanBus {
 public:
  using Observer = std::function<void(const can::StampedFrame&)>;
  using Filter = std::function<bool(const can::Frame&, Time)>;

  /// `name` is the limb's ("rarm"), `interface_name` that of the network interface it stands for
  /// ("can_rarm"). Throws std::runtime_error for a bit rate outside 10 kbit/s .. 1 Mbit/s.
  CanBus(std::string name, std::string interface_name, const BusOptions& options = {});

  /// Adds a participant, which must outlive the bus. Not between calls of `advance` in cyclic operation:
  /// allocates.
  void attach(Participant& participant);

  /// The computer's end. What is sent here takes part in arbitration from `now` on.
  [[nodiscard]] can::Interface& computer_end() noexcept { return computer_; }

  /// One more computer on the bus, for a tool; lives as long as the bus. Allocates.
  [[nodiscard]] ComputerEnd& add_end();

  /// Lets everything happen up to and including `until`; earlier times than `now` do nothing.
  void advance(Time until) noexcept;

  [[nodiscard]] Time now() const noexcept { return now_; }

  /// No frame is under way, in its intermission or waiting to be sent.
  [[nodiscard]] bool quiet() const noexcept;

  /// When something will happen next of itself: a frame ends, a participant's timer runs. Time::max() if
  /// never.
  [[nodiscard]] Time next_event() const noexcept;
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::string_view interface_name() const noexcept { return computer_.name(); }
  [[nodiscard]] std::uint32_t bit_rate() const noexcept { return options_.bit_rate; }

  /// Called with every frame that is complete and not lost. Must not throw.
  void set_observer(Observer observer) { observer_ = std::move(observer); }

  /// Called at the end of every frame; false loses it for all receivers, its sender notices nothing. Must not
  /// throw.
  void set_filter(Filter filter) { filter_ = std::move(filter); }

  [[nodiscard]] BusCounters counters() const noexcept;

  /// Share of the last second the bus was busy, 0..1.
  [[nodiscard]] double load() noexcept { return load_.load(now_, options_.bit_rate); }

 private:
  enum class Phase { kIdle, kFrame, kIntermission };

  [[nodiscard]] Time bit_time(int bits) const noexcept;
  [[nodiscard]] Time next_timer() const noexcept;
  void run_timers() noexcept;
  bool arbitrate() noexcept;
  void complete() noexcept;

  std::string name_;
  BusOptions options_;
  ComputerEnd computer_;
  std::vector<std::unique_ptr<ComputerEnd>> tools_;
  std::vector<Participant*> participants_;
  Observer observer_;
  Filter filter_;

  Time now_{};
  Phase phase_ = Phase::kIdle;
  Time phase_ends_{};
  can::Frame frame_;
  int frame_bits_ = 0;
  const Participant* sender_ = nullptr;

  BusCounters counters_;
  LoadMeter load_;
};

}  // namespace walkman::bus
