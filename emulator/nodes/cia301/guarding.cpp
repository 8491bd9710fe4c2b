#include "emulator/nodes/cia301/guarding.h"

#include "drivers/canopen/cob_id.h"

namespace walkman::nodes {

NodeGuarding::NodeGuarding(ObjectDictionary& dictionary, Outbox& outbox, const std::uint8_t& node_id,
                           const Time& now)
    : outbox_(outbox), node_id_(node_id) {
  guard_time_ = dictionary.object<std::uint16_t>(0x100C);
  guard_time_.on_write([this, &now](std::uint16_t value) -> Refusal {
    watch(now, value, factor_.get());
    return std::nullopt;
  });
  factor_ = dictionary.object<std::uint8_t>(0x100D);
  factor_.on_write([this, &now](std::uint8_t value) -> Refusal {
    watch(now, guard_time_.get(), value);
    return std::nullopt;
  });
}

void NodeGuarding::watch(Time from, std::uint16_t guard_ms, std::uint8_t factor) noexcept {
  const Time life = std::chrono::milliseconds(std::uint32_t{guard_ms} * factor);
  deadline_ = guarded_ && life > Time{} ? from + life : Time::max();
  if (life == Time{}) lost_ = false;
}

bool NodeGuarding::answer(canopen::NmtState state, Time now) noexcept {
  const auto status = static_cast<std::uint8_t>((toggle_ ? 0x80U : 0U) | static_cast<std::uint8_t>(state));
  outbox_.push(can::Frame(canopen::cob_id::error_control(node_id_), {status}));
  toggle_ = !toggle_;
  guarded_ = true;
  watch(now, guard_time_.get(), factor_.get());
  const bool was_lost = lost_;
  lost_ = false;
  return was_lost;
}

bool NodeGuarding::advance(Time now) noexcept {
  if (deadline_ > now) return false;
  deadline_ = Time::max();
  lost_ = true;
  return true;
}

void NodeGuarding::reset() noexcept {
  toggle_ = guarded_ = lost_ = false;
  deadline_ = Time::max();
}

}  // namespace walkman::nodes
