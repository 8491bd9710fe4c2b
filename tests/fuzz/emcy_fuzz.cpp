// Emergency objects of every device into the master: arbitrary codes, registers and manufacturer-specific
// bytes, of any length; and their description in words.

#include <array>

#include "drivers/canopen/emcy_message.h"
#include "tests/fuzz/master_talk.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  constexpr std::array<std::uint8_t, 5> kNodes = {11, 18, 19, 31, 91};
  fuzz::Input input(data, size);
  fuzz::MasterTalk talk;
  std::uint64_t told = 0;
  talk.run([&](bool running) {
    if (!running) return true;
    const unsigned how = input.byte();
    const std::size_t node = (how & 7U) % kNodes.size();
    can::Frame frame(canopen::cob_id::emcy(kNodes[node]), input.bytes(8));
    frame.length = static_cast<std::uint8_t>((how & 8U) != 0 ? how >> 4U & 7U : 8);
    const auto message = canopen::decode_emcy(frame);
    fuzz::require(message.has_value() == (frame.length == 8), "an EMCY has 8 bytes");
    if (message && message->code != 0) ++told;
    (node < 3 ? talk.rig.rarm : talk.rig.torso).inject(frame, talk.rig.now);
    return !input.empty();
  });
  fuzz::require(talk.rig.robot->counters().emergencies <= told,
                "no more emergencies are counted than there were");
  return 0;
}
