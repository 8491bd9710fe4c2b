#pragma once

#include <array>
#include <cstdint>

#include "tests/bench/vcan/bus_socket.h"

namespace walkman::bench {

/// The right arm's nodes by their node-IDs: joints 11 to 17, wrist sensor 18, hand 19.
constexpr std::array<int, 9> kNodes{11, 12, 13, 14, 15, 16, 17, 18, 19};
constexpr int kDrive = 11;
constexpr int kHand = 19;

/// A master's messages to the limb, byte by byte.
class LimbClient {
 public:
  explicit LimbClient(BusSocket& bus) : bus_(bus) {}

  /// Resets all nodes and waits for their boot-up messages; throws std::runtime_error if one is still missing
  /// after `seconds`. `alive` may throw to end the wait.
  void boot(double seconds, const std::function<void()>& alive);
  void start(int node);
  /// Makes the hand answer every SYNC like the other nodes.
  void hand_answers_every_sync();
  /// Performs one expedited upload of the statusword; throws on an abort.
  void upload_statusword(int node);
  /// Sends one SYNC and waits for `count` TPDO1 and TPDO2 of any nodes.
  void sync_and_await(int count);

 private:
  void write(int node, int index, int sub, int size, std::uint32_t value);
  void await_sdo(int node, int expected);

  BusSocket& bus_;
};

/// Returns whether a frame is a TPDO1 or TPDO2 of a node of the limb.
bool is_cyclic_tpdo(const can_frame& frame);

}  // namespace walkman::bench
