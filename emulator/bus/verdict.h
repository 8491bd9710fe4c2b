#pragma once

namespace walkman::bus {

class Participant;

/// What is to happen to one frame on the wire: deterministic fault injection.
struct Verdict {
  enum class Kind {
    kDeliver,
    kLose,           ///< nobody receives it and nobody notices; it takes its time
    kCorrupt,        ///< a bit is turned over and the frame ends in an error frame
    kNoAcknowledge,  ///< the ACK slot stays recessive
  };

  Kind kind = Kind::kDeliver;
  /// kCorrupt: number of the bit on the wire, stuff bits counted, SOF = 0; beyond the end of frame means its
  /// last bit.
  int bit = 0;
  /// kCorrupt: the receiver that alone sees the turned bit; null when the sender does, and so all.
  const Participant* seen_by = nullptr;

  static constexpr Verdict deliver() noexcept { return {}; }
  static constexpr Verdict lose() noexcept { return {Kind::kLose}; }
  static constexpr Verdict corrupt(int bit, const Participant* seen_by = nullptr) noexcept {
    return {Kind::kCorrupt, bit, seen_by};
  }
  static constexpr Verdict no_acknowledge() noexcept { return {Kind::kNoAcknowledge}; }
};

}  // namespace walkman::bus
