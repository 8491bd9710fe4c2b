#pragma once

#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::nodes {

/// TIME consumer (CiA 301, 7.2.6), COB-ID 1012h (bit 31 = consume), and the node's clock that TIME sets:
/// 2061h, sub 1 milliseconds after midnight, sub 2 days since 1984-01-01. The clock keeps running between two
/// TIME messages; at power-on it starts at that epoch.
class NodeClock {
 public:
  /// `now`: the node's clock, read when 2061h is read; must outlive this.
  NodeClock(ObjectDictionary& dictionary, const Time& now);
  NodeClock(const NodeClock&) = delete;
  NodeClock& operator=(const NodeClock&) = delete;

  [[nodiscard]] bool accepts(const can::Frame& frame) const noexcept;
  /// Ignores anything but 6 bytes with a time of day.
  void receive(const can::Frame& frame, Time now) noexcept;

 private:
  void publish(Time now) noexcept;

  Object<std::uint32_t> cob_id_, milliseconds_;
  Object<std::uint16_t> days_;
  Time offset_{};  // from the node's time to the time since the epoch
};

}  // namespace walkman::nodes
