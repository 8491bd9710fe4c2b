// Anything that the peer of a serial-line adapter may write, in pieces of any size, between frames of a bus;
// and a round trip of every frame that the protocol can carry.

#include "emulator/bus/frame_length.h"
#include "emulator/gateways/slcan_adapter.h"
#include "emulator/gateways/slcan_protocol.h"
#include "emulator/nodes/drive/drive_node.h"
#include "tests/fuzz/input.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::fuzz {
namespace {

/// Requires lines that end in a carriage return, or BELs.
void require_answers(std::string_view text) {
  require(text.empty() || text.back() == '\r' || text.back() == '\a', "a peer gets whole answers");
  for (const char c : text) require((c >= ' ' && c <= '~') || c == '\r' || c == '\a', "an answer is text");
}

void require_same_there_and_back(const can::Frame& frame) {
  gateways::TextLine line;
  const bool written = gateways::write_slcan({{}, frame}, false, line);
  require(written == (!frame.fd && !frame.error), "classical frames can be written, others cannot");
  if (!written) return;
  std::string_view text = line.text();
  text.remove_suffix(1);
  can::Frame back;
  require(gateways::read_slcan(text, back) && back == frame, "a frame is the same there and back");
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  fuzz::Input input(data, size);
  bus::CanBus rarm("rarm", "can_rarm", {.fd = (input.byte() & 1U) != 0});
  nodes::DriveNode drive(nodes::test_drive());
  rarm.attach(drive);
  rarm.set_observer([](const can::StampedFrame& frame) {
    fuzz::require(bus::is_sendable(frame.frame), "a bus carries what it can");
  });
  gateways::SlcanAdapter adapter(rarm);
  const auto drain = [&] {
    fuzz::require_answers(adapter.outgoing().text());
    adapter.outgoing().pop(adapter.outgoing().text().size());
  };
  while (!input.empty()) {
    const unsigned how = input.byte();
    if (how == 255) {
      adapter.reset();
    } else if ((how & 3U) == 0) {
      const can::Frame frame = input.frame();
      fuzz::require_same_there_and_back(frame);
      static_cast<void>(rarm.computer_port().send(frame));
    } else if ((how & 3U) == 1) {
      rarm.advance(rarm.now() + input.pause());
      adapter.forward();
      if ((how & 4U) == 0) drain();
    } else {
      adapter.take(input.text(how >> 2U));
      if ((how & 1U) != 0) drain();
    }
  }
  return 0;
}
