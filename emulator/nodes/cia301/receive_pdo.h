#pragma once

#include "drivers/can/frame.h"
#include "drivers/canopen/pdo_protection.h"
#include "drivers/time.h"
#include "emulator/nodes/cia301/pdo_record.h"

namespace walkman::nodes {

/// One RPDO (CiA 301, 7.2.2): types 0..240 take effect at the next SYNC, 254 and 255 at once; sub-index 5 is
/// a deadline between two receptions, watched from the first one on.
class ReceivePdo {
 public:
  /// What happened to a frame. One that is dropped as late counts as taken.
  enum class Outcome {
    kTaken,
    kTakenTooLong,  ///< longer than mapped (8220h)
    kTooShort,      ///< shorter than mapped (8210h); no effect
    kRefused        ///< protected, with a wrong CRC or an old count; no effect
  };

  /// `number`: 1..4; `cob_id`: its predefined COB-ID, the factory setting of sub-index 1. The objects of the
  /// default mapping must already be in the dictionary; throws std::runtime_error if one cannot be mapped.
  ReceivePdo(ObjectDictionary& dictionary, int number, std::uint32_t cob_id, const PdoDefaults& defaults);

  void start() noexcept;  ///< entering operational
  void stop() noexcept;   ///< leaving it
  void reload() noexcept { record_.reload(); }
  void observe(PdoRecord::Observer observer) { record_.observe(std::move(observer)); }
  void use_fd() { record_.use_fd(); }

  [[nodiscard]] bool accepts(const can::Frame& frame) const noexcept {
    return operational_ && record_.valid() && frame.id == record_.identifier();
  }
  /// Takes a frame with the PDO's identifier. One shorter than mapped is ignored; of a longer one, the first
  /// bytes are used; the padding of a CAN FD frame does not count. `late`: the window for synchronous PDOs is
  /// over, a synchronous one is dropped.
  [[nodiscard]] Outcome receive(const can::Frame& frame, bool late, Time now) noexcept;
  /// Handles SYNC: what a synchronous PDO has received takes effect.
  void sync() noexcept;

  /// Returns true if the deadline has just passed without a reception.
  [[nodiscard]] bool advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept { return deadline_; }

 private:
  void apply() noexcept;
  void restart() noexcept;

  ObjectDictionary& dictionary_;
  Time deadline_ = Time::max();
  bool operational_ = false;
  bool waiting_ = false;  // for the next SYNC
  PdoRecord record_;
  canopen::PdoGuard guard_;
  std::array<std::uint8_t, PdoRecord::kMaxBytes> data_{};
};

}  // namespace walkman::nodes
