// Arbitrary frames into the master, on two buses, while it boots its devices, runs them and recovers.

#include <array>

#include "tests/fuzz/master_talk.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  // Frames that devices send, by function code and node.
  constexpr std::array<std::uint32_t, 8> kFunctions = {0x080, 0x180, 0x280, 0x380,
                                                       0x480, 0x580, 0x700, 0x000};
  constexpr std::array<std::uint32_t, 6> kNodes = {11, 18, 19, 31, 91, 127};
  fuzz::Input input(data, size);
  const bool from_the_start = (input.byte() & 1U) != 0;
  fuzz::MasterTalk talk;
  talk.run([&](bool running) {
    if (!running && !from_the_start) return true;
    const unsigned how = input.byte();
    for (unsigned i = 0; i < (how & 7U); ++i) {
      test::FakeBus& bus = (how & 8U) != 0 ? talk.rig.torso : talk.rig.rarm;
      can::Frame frame = input.frame();
      if ((how & 16U) == 0 && !frame.extended && !frame.error)
        frame.id = kFunctions[frame.id % 8] + kNodes[(frame.id >> 3U) % 6];
      bus.inject(frame, talk.rig.now);
    }
    test::FakeBus& bus = talk.rig.rarm;
    bus.state = (how & 32U) != 0 ? static_cast<can::LinkState>(how >> 6U) : can::LinkState::kActive;
    return !input.empty();
  });
  return 0;
}
