// Nothing that a frame can request from a node allocates.

#include <gtest/gtest.h>

#include "tests/unit/nodes/allocation_count.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

struct Host {
  explicit Host(CanopenSlave& device) : node(device) { node.advance(now); }
  void send(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    now += std::chrono::microseconds(200);
    node.receive(can::Frame(id, data), now);
    drain();
  }
  void drain() {
    node.advance(now);
    while (node.pending() != nullptr) {
      node.take();
      ++frames;
    }
  }
  CanopenSlave& node;
  Time now{};
  int frames = 0;
};

TEST(ServicesAllocation, NoneInSdoNmtLssTimeStoreAndSync) {
  TestSlave node;
  node.losses.reserve(64);
  Host host(node);
  host.drain();
  const long before = allocation_count();
  // Block download of 70 bytes to the user note, then saving everything, block upload, segmented upload.
  host.send(0x605, {0xC2, 0x60, 0x20, 0, 70, 0, 0, 0});
  for (std::uint8_t i = 1; i <= 10; ++i) {
    host.send(0x605, {static_cast<std::uint8_t>(i == 10 ? 0x80 + i : i), 'a', 'b', 'c', 'd', 'e', 'f', 'g'});
  }
  host.send(0x605, {0xC1, 0, 0, 0, 0, 0, 0, 0});
  host.send(0x605, {0x23, 0x10, 0x10, 1, 's', 'a', 'v', 'e'});
  host.send(0x000, {0x81, 0x05});
  host.send(0x605, {0xA4, 0x60, 0x20, 0, 127, 0, 0, 0});
  host.send(0x605, {0xA3, 0, 0, 0, 0, 0, 0, 0});
  host.send(0x605, {0xA2, 10, 127, 0, 0, 0, 0, 0});
  host.send(0x605, {0xA1, 0, 0, 0, 0, 0, 0, 0});
  host.send(0x605, {0x40, 0x60, 0x20, 0, 0, 0, 0, 0});
  for (int i = 0; i < 10; ++i) {
    host.send(0x605, {static_cast<std::uint8_t>(i % 2 == 0 ? 0x60 : 0x70), 0, 0, 0, 0, 0, 0, 0});
  }
  host.send(0x605, {0x23, 0x11, 0x10, 1, 'l', 'o', 'a', 'd'});
  host.send(0x000, {0x82, 0x05});
  host.send(0x100, {0, 0, 0, 0, 1, 0});
  host.send(0x7E5, {4, 1, 0, 0, 0, 0, 0, 0});
  host.send(0x7E5, {0x5A, 0, 0, 0, 0, 0, 0, 0});
  host.send(0x7E5, {4, 0, 0, 0, 0, 0, 0, 0});
  host.send(0x605, {0x23, 0x06, 0x10, 0, 0x88, 0x13, 0, 0});
  host.send(0x605, {0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0x40});
  host.send(0x605, {0x2B, 0x17, 0x10, 0, 10, 0, 0, 0});
  host.send(0x000, {0x01, 0x05});
  host.send(0x205, {1, 2});  // too short: EMCY
  for (int i = 0; i < 100; ++i) {
    host.now += std::chrono::milliseconds(1);
    host.drain();
  }
  node.on_link_state(can::LinkState::kBusOff, host.now);
  node.on_link_state(can::LinkState::kActive, host.now);
  host.drain();
  EXPECT_EQ(allocation_count() - before, 0);
  EXPECT_EQ(node.resets, 1);
  EXPECT_GT(host.frames, 80);
}

}  // namespace
}  // namespace walkman::nodes
