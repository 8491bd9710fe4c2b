#pragma once

#include <cstdint>

#include "emulator/bus/computer_port.h"
#include "emulator/bus/fault_confinement.h"
#include "emulator/bus/frame_length.h"
#include "emulator/bus/participant.h"

namespace walkman::bus {

/// Role of a controller in the frame under way.
enum class Role : std::uint8_t {
  kNone,  ///< not on the bus
  kReceiving,
  kSending,
  kMissing,     ///< the only receiver that saw an error; error-passive, it could not stop the frame
  kDroppedOut,  ///< one of several senders that saw a bit error, and could not stop the frame either
};

/// A participant's CAN controller, as the bus models it: one transmit buffer, which holds a frame from its
/// first attempt until it has been sent, and fault confinement.
struct Controller {
  explicit Controller(Participant& owner, ComputerPort* port) : participant(&owner), computer(port) {}

  static constexpr std::uint64_t kNothing = ~std::uint64_t{0};

  Participant* participant;
  ComputerPort* computer;        ///< port of a computer, else null
  Time due{};                    ///< the participant's next event
  std::uint64_t key = kNothing;  ///< arbitration key of the frame it would send
  FaultConfinement faults;
  Role role = Role::kNone;
  bool holding = false;        ///< `held` waits for another attempt, or is under way
  bool cut = false;            ///< its cable is disconnected
  bool sending_alone = false;  ///< while cut: it is sending to nobody
  bool recovering = false;
  Time suspended_until{};  ///< suspend transmission of an error-passive sender
  Time alone_until{};
  int recovery_runs = 0;   ///< runs of 11 recessive bits still to be seen
  Time recessive_since{};  ///< in recovery: start of the current run of recessive bits
  can::Frame held;

  [[nodiscard]] bool online() const noexcept { return !cut && !faults.bus_off(); }

  /// Updates `due` and `key` after anything that may have changed what the participant has to do or send.
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
  /// Takes the next frame from the participant, unless one is being held.
  void hold() noexcept {
    if (holding) return;
    held = *participant->pending();
    participant->take();
    holding = true;
  }
};

}  // namespace walkman::bus
