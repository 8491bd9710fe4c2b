#pragma once

#include <cstdint>

#include "drivers/canopen/cob_id.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// Node and life guarding (CiA 301, 7.2.8.3.2.1): answers the master's remote frame on 700h + node-ID, and
/// monitors these frames. Guard time 100Ch in ms times life time factor 100Dh is the time within which the
/// next one must arrive; it runs from the first one on, and never if either is 0.
class NodeGuarding {
 public:
  /// `now`: the node's clock, read when 100Ch or 100Dh is written. It and `node_id` must outlive this.
  NodeGuarding(ObjectDictionary& dictionary, Outbox& outbox, const std::uint8_t& node_id, const Time& now);
  NodeGuarding(const NodeGuarding&) = delete;
  NodeGuarding& operator=(const NodeGuarding&) = delete;

  /// Answers with the state and a toggle bit that starts with 0. Returns true if the master had been lost.
  [[nodiscard]] bool answer(canopen::NmtState state, Time now) noexcept;
  /// Returns true if the life time has just expired.
  [[nodiscard]] bool advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept { return deadline_; }
  /// Whether the master is lost; until the next remote frame, or until 0 is written to 100Ch or 100Dh.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Stops monitoring until the next remote frame; the toggle bit restarts with 0.
  void reset() noexcept;

 private:
  void watch(Time from, std::uint16_t guard_ms, std::uint8_t factor) noexcept;

  Outbox& outbox_;
  const std::uint8_t& node_id_;
  Object<std::uint16_t> guard_time_;
  Object<std::uint8_t> factor_;
  bool toggle_ = false;
  bool guarded_ = false;  // a remote frame has come
  bool lost_ = false;
  Time deadline_ = Time::max();
};

}  // namespace walkman::nodes
