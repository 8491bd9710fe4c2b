#include "tests/bench/vcan/limb_client.h"

#include <set>
#include <stdexcept>

#include <fmt/format.h>

namespace walkman::bench {

bool is_cyclic_tpdo(const can_frame& frame) {
  const std::uint32_t base = frame.can_id & ~0x7Fu;
  const int node = static_cast<int>(frame.can_id & 0x7Fu);
  return (base == 0x180 || base == 0x280) && node >= kNodes.front() && node <= kNodes.back();
}

void LimbClient::boot(double seconds, const std::function<void()>& alive) {
  const auto ends = SteadyClock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    alive();
    bus_.drain();
    bus_.send(frame_of(0x000, {0x81, 0x00}));
    std::set<std::uint32_t> booted;
    try {
      bus_.receive_until([&](const can_frame& frame) {
        if ((frame.can_id & ~0x7Fu) == 0x700 && frame.len == 1 && frame.data[0] == 0)
          booted.insert(frame.can_id);
        return booted.size() == kNodes.size();
      });
      return;
    } catch (const std::runtime_error&) {
      if (SteadyClock::now() > ends) {
        throw std::runtime_error(fmt::format("{} of {} nodes booted", booted.size(), kNodes.size()));
      }
    }
  }
}

void LimbClient::start(int node) {
  bus_.send(frame_of(0x000, {0x01, node}));
  upload_statusword(node == 0 ? kDrive : node);  // answered after the command has been executed
}

void LimbClient::write(int node, int index, int sub, int size, std::uint32_t value) {
  const auto byte = [](std::uint32_t word, int at) { return static_cast<int>(word >> (8 * at) & 0xFF); };
  bus_.send(frame_of(0x600u + static_cast<unsigned>(node),
                     {0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub, byte(value, 0), byte(value, 1),
                      byte(value, 2), byte(value, 3)}));
  await_sdo(node, 0x60);
}

void LimbClient::await_sdo(int node, int expected) {
  int answer = -1;
  bus_.receive_until([&](const can_frame& frame) {
    if (frame.can_id == 0x580u + static_cast<unsigned>(node)) answer = frame.data[0];
    return answer >= 0;
  });
  if (answer != expected) {
    throw std::runtime_error(
        fmt::format("SDO of node {} answered by {:02X}h, not {:02X}h", node, answer, expected));
  }
}

void LimbClient::hand_answers_every_sync() {
  for (const int record : {0x1800, 0x1801}) {
    const std::uint32_t cob_id = (record == 0x1800 ? 0x180u : 0x280u) + kHand;
    write(kHand, record, 1, 4, 0xC0000000u | cob_id);
    write(kHand, record, 2, 1, 1);
    write(kHand, record, 1, 4, 0x40000000u | cob_id);
  }
}

void LimbClient::upload_statusword(int node) {
  bus_.send(frame_of(0x600u + static_cast<unsigned>(node), {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
  await_sdo(node, 0x4B);
}

void LimbClient::sync_and_await(int count) {
  bus_.send(frame_of(0x080, {}));
  bus_.receive_until([&](const can_frame& frame) { return is_cyclic_tpdo(frame) && --count == 0; });
}

}  // namespace walkman::bench
