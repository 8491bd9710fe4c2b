#pragma once

#include "emulator/nodes/cia301/outbox.h"
#include "emulator/nodes/cia301/pdo_record.h"

namespace walkman::nodes {

/// One TPDO (CiA 301, 7.2.2): transmission types 0 (with the next SYNC after a change), 1..240 (every n-th
/// SYNC), 252 (sampled at SYNC, sent on remote request), 253 (sampled and sent on remote request), 254 and
/// 255 (event: application, event timer), inhibit time, remote request. An event of the application is a
/// change that it announces with `event`; the first transmission takes place on entering operational.
///
/// With a SYNC start value (sub-index 6) and a SYNC with a counter, the SYNC with that counter value is the
/// first of the n.
class TransmitPdo {
 public:
  /// `number`: 1..4; `cob_id`: its predefined COB-ID, the factory setting of sub-index 1; `now`: the node's
  /// clock, read when the PDO's parameters are written; must outlive this. Throws std::runtime_error if an
  /// object of the default mapping cannot be mapped.
  TransmitPdo(ObjectDictionary& dictionary, Outbox& outbox, int number, std::uint32_t cob_id,
              const PdoDefaults& defaults, const Time& now);

  void start(Time now) noexcept;  ///< entering operational
  void stop() noexcept;           ///< leaving it
  void reload() noexcept { record_.reload(); }
  void observe(PdoRecord::Observer observer) { record_.observe(std::move(observer)); }

  void use_fd() { record_.use_fd(); }

  /// Handles SYNC; `counter`: that of the SYNC, 0 if it has none. Hot: samples the objects at every SYNC.
  void sync(std::uint8_t counter, Time now) noexcept;
  /// Ends the window for synchronous PDOs: what is still waiting is not sent.
  void close_window() noexcept;
  void event(const Entry& entry, Time now) noexcept;
  void remote_request(std::uint32_t identifier, Time now) noexcept;
  void advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept;

 private:
  void restart(Time now) noexcept;
  void request(Time now) noexcept;
  void transmit(Time now) noexcept;
  void take_sample() noexcept;
  [[nodiscard]] can::Frame sample() const noexcept;
  [[nodiscard]] bool running() const noexcept { return operational_ && record_.valid(); }

  Outbox& outbox_;
  Time allowed_from_{};
  Time event_due_ = Time::max();
  bool operational_ = false;
  bool started_ = false;    // the SYNC with the start value has come
  bool requested_ = false;  // waits for the end of the inhibit time
  bool sent_ = false;       // `last_` holds something
  std::uint8_t count_ = 0;  // of the samples sent, for a protected PDO
  int syncs_ = 0;           // since the last transmission
  PdoRecord record_;
  can::Frame last_;  // last frame sent; for type 252, last one sampled
};

}  // namespace walkman::nodes
