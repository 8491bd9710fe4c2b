// LSS requests (CiA 305) into two nodes on one bus, one of which has no node-ID, between NMT commands.
// However they are set, neither ever has a node-ID outside the standard, and both can be found again.

#include <array>

#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/drive/drive_node.h"
#include "tests/fuzz/node_talk.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::fuzz {
namespace {

constexpr std::uint32_t kRequest = 0x7E5, kResponse = 0x7E4;
constexpr std::array<std::uint8_t, 28> kCommands = {
    0x04, 0x11, 0x13, 0x15, 0x17, 0x40, 0x41, 0x42, 0x43, 0x46, 0x47, 0x48, 0x49, 0x4A,
    0x4B, 0x4C, 0x51, 0x51, 0x51, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E, 0x44, 0x4F, 0x50, 0xFF};

can::Frame lss(std::uint8_t command, std::uint32_t value, std::span<const std::uint8_t> rest = {}) {
  can::Frame frame(kRequest, {command});
  frame.length = 8;
  canopen::put(frame.data.data() + 1, value);
  std::copy_n(rest.begin(), std::min<std::size_t>(rest.size(), 3), frame.data.begin() + 5);
  return frame;
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  using namespace walkman::fuzz;
  Input input(data, size);
  nodes::DriveNode first(nodes::test_drive(5)), second(nodes::test_drive(6));
  std::array<NodeTalk, 2> talks{NodeTalk(first, false), NodeTalk(second, false)};
  const auto say = [&](const can::Frame& frame) {
    for (NodeTalk& talk : talks) {
      talk.hear(frame);
      talk.wait(std::chrono::microseconds(130), false);
    }
  };
  while (!input.empty()) {
    const unsigned how = input.byte();
    if ((how & 7U) == 0) {
      const Time pause = input.pause();
      for (NodeTalk& talk : talks) talk.wait(pause, (how & 8U) != 0);
    } else if ((how & 7U) == 1) {
      say({0, {input.byte(), static_cast<std::uint8_t>((how & 8U) != 0 ? 0 : input.byte() % 8)}});
    } else if ((how & 7U) == 2) {
      say(input.frame());
    } else {
      // A value of one of the two nodes, or any value.
      const std::uint8_t command = kCommands[input.byte() % kCommands.size()];
      std::uint32_t value = std::uint32_t{input.word()} | std::uint32_t{input.word()} << 16U;
      const nodes::CanopenSlave& meant = (how & 8U) != 0 ? first : second;
      if ((how & 16U) != 0)
        value = meant.dictionary().find(0x1018, static_cast<std::uint8_t>(1 + value % 4))->raw;
      say(lss(command, value, input.bytes(3)));
    }
    for (const nodes::CanopenSlave* node : {&first, &second})
      require(node->node_id() == 0xFF || (node->node_id() >= 1 && node->node_id() <= 127),
              "a node-ID is in range");
  }
  // Both can be addressed in either state, and then answer with their serial numbers.
  say(lss(0x04, 0));
  int found = 0;
  for (NodeTalk& talk : talks)
    talk.heard = [&](const can::Frame& frame) {
      if (frame.id == kResponse && frame.data[0] == 0x5D) ++found;
    };
  say(lss(0x04, 1));
  say(lss(0x5D, 0));
  require(found == 2, "both nodes can be asked for their serial numbers");
  return 0;
}
