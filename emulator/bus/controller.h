#pragma once

#include <cstdint>

#include "emulator/bus/computer_port.h"
#include "emulator/bus/fault_confinement.h"
#include "emulator/bus/frame_length.h"
#include "emulator/bus/participant.h"

namespace walkman::bus {

/// What a controller has to do with the frame under way.
enum class Role : std::uint8_t {
  kNone,  ///< not on the bus
  kReceiving,
  kSending,
  kMissing,     ///< a receiver that alone saw an error, and could not stop the frame as error-passive
  kDroppedOut,  ///< one of several senders that saw a bit error, and could not stop the frame either
};

/// A participant's CAN controller, as the bus keeps it: one transmit buffer, which holds a frame from its
/// first attempt until it is through, and fault confinement.
struct Controller {
  explicit Controller(Participant& owner, ComputerPort* port) : participant(&owner), computer(port) {}

  static constexpr std::uint64_t kNothing = ~std::uint64_t{0};

  Participant* participant;
  ComputerPort* computer;        ///< of a computer, else null
  Time due{};                    ///< the participant's next event
  std::uint64_t key = kNothing;  ///< arbitration key of the frame it would send
  FaultConfinement faults;
  Role role = Role::kNone;
  bool holding = false;        ///< `held` waits for another attempt, or is under way
  bool cut = false;            ///< its cable is off
  bool sending_alone = false;  ///< while cut: it is sending to nobody
  bool recovering = false;
  Time suspended_until{};  ///< suspend transmission of an error-passive sender
  Time alone_until{};
  int recovery_runs = 0;   ///< of 11 recessive bits, still to be seen
  Time recessive_since{};  ///< in recovery: start of the present run of recessive bits
  can::Frame held;

  [[nodiscard]] bool online() const noexcept { return !cut && !faults.bus_off(); }

  /// Brings `due` and `key` up to date, after anything that may have changed what the participant wants.
  void refresh() noexcept {
    due = participant->next_event();
    offer();
  }
  void offer() noexcept {
    if (!online()) {
      key = kNothing;
    } else if (!holding) {
      const can::Frame* frame = participant->pending();
      key = frame == nullptr ? kNothing : arbitration_key(*frame);
    } else {
      key = arbitration_key(held);
    }
  }
  /// Takes the next frame out of the participant, unless one is being held.
  void hold() noexcept {
    if (holding) return;
    held = *participant->pending();
    participant->take();
    holding = true;
  }
};

}  // namespace walkman::bus
