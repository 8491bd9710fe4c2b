#pragma once

#include <array>
#include <cstdint>

#include "drivers/canopen/cob_id.h"
#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// Heartbeat producer (CiA 301, 7.2.8.3.2.2), object 1017h. The first heartbeat follows one period after the
/// time is written or the boot-up message was sent.
class HeartbeatProducer {
 public:
  /// `now`: the node's clock, read when 1017h is written. It and `node_id` must outlive the producer.
  HeartbeatProducer(ObjectDictionary& dictionary, Outbox& outbox, const std::uint8_t& node_id,
                    const Time& now);
  HeartbeatProducer(const HeartbeatProducer&) = delete;
  HeartbeatProducer& operator=(const HeartbeatProducer&) = delete;

  /// Sends the boot-up message and restarts the period.
  void boot_up(Time now) noexcept;
  void advance(Time now, canopen::NmtState state) noexcept;
  [[nodiscard]] Time next_event() const noexcept { return due_; }
  [[nodiscard]] bool in_use() const noexcept { return period_.get() != 0; }
  void stop() noexcept { due_ = Time::max(); }

 private:
  void schedule(Time from, std::uint16_t period_ms) noexcept;
  void send(canopen::NmtState state) noexcept;

  Outbox& outbox_;
  const std::uint8_t& node_id_;
  Object<std::uint16_t> period_;
  Time due_ = Time::max();
};

/// Heartbeat consumer (CiA 301, 7.2.8.3.2.2), object 1016h with four entries: bits 16-23 node-ID, 0-15 time
/// in ms. A node is watched from its first heartbeat on. An entry with time 0, node 0 or a node above 127 is
/// not in use.
class HeartbeatConsumer {
 public:
  static constexpr std::size_t kEntries = 4;

  explicit HeartbeatConsumer(ObjectDictionary& dictionary);
  HeartbeatConsumer(const HeartbeatConsumer&) = delete;
  HeartbeatConsumer& operator=(const HeartbeatConsumer&) = delete;

  /// Notes a heartbeat of `node`.
  void beat(std::uint8_t node, Time now) noexcept;
  /// Returns true if a watched node has just failed to send in time; `lost_node` is the first of them.
  [[nodiscard]] bool advance(Time now) noexcept;
  [[nodiscard]] std::uint8_t lost_node() const noexcept { return lost_node_; }
  [[nodiscard]] bool any_lost() const noexcept;
  [[nodiscard]] Time next_event() const noexcept;
  void reset() noexcept;

 private:
  struct Watch {
    Time deadline = Time::max();
    bool lost = false;
  };

  [[nodiscard]] Refusal check(std::size_t entry, std::uint32_t value) const noexcept;

  std::array<Object<std::uint32_t>, kEntries> entries_;
  std::array<Watch, kEntries> watches_{};
  std::uint8_t lost_node_ = 0;
};

}  // namespace walkman::nodes
