#pragma once

#include <cstddef>
#include <vector>

#include "emulator/bus/controller.h"
#include "emulator/bus/error_message.h"
#include "emulator/bus/frame_length.h"
#include "emulator/bus/participant.h"
#include "emulator/bus/wire_bits.h"

namespace walkman::bus {

/// What happens to one frame on the wire: deterministic fault injection.
struct FrameFate {
  enum class Kind {
    kDeliver,
    kLose,           ///< nobody receives it and nobody notices; it takes its usual time
    kCorrupt,        ///< a bit is inverted and the frame ends in an error frame
    kNoAcknowledge,  ///< the ACK slot stays recessive
  };

  Kind kind = Kind::kDeliver;
  /// kCorrupt: number of the bit on the wire, counting stuff bits, SOF = 0; a number beyond the end of frame
  /// means its last bit.
  int bit = 0;
  /// kCorrupt: the only receiver that sees the inverted bit; null if the sender and therefore all see it.
  const Participant* seen_by = nullptr;

  static constexpr FrameFate deliver() noexcept { return {}; }
  static constexpr FrameFate lose() noexcept { return {Kind::kLose}; }
  static constexpr FrameFate corrupt(int bit, const Participant* seen_by = nullptr) noexcept {
    return {Kind::kCorrupt, bit, seen_by};
  }
  static constexpr FrameFate no_acknowledge() noexcept { return {Kind::kNoAcknowledge}; }
};

inline constexpr int kErrorFlagBits = 6;
inline constexpr int kErrorDelimiterBits = 8;

/// One attempt to send a frame, planned when it starts: how long it takes, and what goes wrong during it
/// (ISO 11898-1, error frame). Planning assigns the controllers their roles; their reactions at the end of
/// the attempt are up to the bus.
struct Attempt {
  WireLength frame;                            ///< until the receivers have it, or until the error flag
  WireLength interframe;                       ///< from there until the next arbitration
  WireLength flag;                             ///< part of the interframe: superposed error flags
  bool failed = false;                         ///< ends in an error frame
  bool destroyed = false;                      ///< and the receivers do not get the frame
  bool mixed = false;                          ///< has several senders, or a receiver that misses it
  bool lost = false;                           ///< nobody receives it, because of a fault
  bool timeless = false;                       ///< takes no time
  const Participant* first_to_flag = nullptr;  ///< the receiver that saw the error before all others
  BusError error;                              ///< as the sender sees it

  /// Lets all controllers that offer `key` at `now` send together: equal frames merge; in different frames
  /// the first bit that differs is a bit error. Returns the number of the sender that represents the attempt.
  [[nodiscard]] std::size_t contend(std::vector<Controller>& controllers, std::uint64_t key,
                                    Time now) noexcept;

  /// Plans the frame of controller number `sender` as if nothing goes wrong.
  void plan_success(const Controller& sender) noexcept;
  /// Plans that the sender reads back a level other than the one it sent at bit number `bit` (in the ACK
  /// slot: sees no acknowledgement).
  void plan_bit_error(const std::vector<Controller>& controllers, std::size_t sender, int bit) noexcept;
  /// Plans that only one receiver sees bit number `bit` inverted.
  void plan_receive_error(std::vector<Controller>& controllers, std::size_t sender, int bit,
                          const Participant& seen_by) noexcept;
  void plan_no_acknowledge(const std::vector<Controller>& controllers, std::size_t sender) noexcept;

 private:
  void plan_error_frame(const WireBits& wire, int bit, unsigned level, unsigned first_flag,
                        bool answered) noexcept;
};

/// Whether any controller has the role and, with `error_active`, is error-active.
[[nodiscard]] bool any_with(const std::vector<Controller>& controllers, Role role,
                            bool error_active = false) noexcept;

}  // namespace walkman::bus
