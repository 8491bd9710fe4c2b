// Anything that a client of the socketcand server may write, in pieces of any size, between frames of a node
// and of the bus's computer. The client receives only whole messages, and the bus only frames that it can
// carry.

#include <array>
#include <string>

#include "emulator/bus/frame_length.h"
#include "emulator/gateways/socketcand_session.h"
#include "emulator/nodes/drive/drive_node.h"
#include "tests/fuzz/input.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::fuzz {
namespace {

/// Requires one "< ... >" after the other, with nothing but line feeds in between.
void require_messages(std::string_view text) {
  bool inside = false;
  for (const char c : text) {
    require(inside ? c != '<' : c == '<' || c == '\n', "what a client gets are messages");
    require(c >= ' ' || c == '\n', "a message is text");
    if (c == '<') inside = true;
    if (c == '>') inside = false;
  }
  require(!inside, "a client gets whole messages");
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  using gateways::SocketcandSession;
  fuzz::Input input(data, size);
  bus::CanBus rarm("rarm", "can_rarm", {.fd = (input.byte() & 1U) != 0});
  nodes::DriveNode drive(nodes::test_drive());
  rarm.attach(drive);
  rarm.set_observer([](const can::StampedFrame& frame) {
    fuzz::require(bus::is_sendable(frame.frame), "a bus carries what it can");
  });
  std::array<bus::CanBus*, 1> buses{&rarm};
  gateways::ControllerPool pool(buses);
  gateways::SocketcandCounters counters;
  Time wall = std::chrono::seconds(1000);
  SocketcandSession session(pool, counters, wall);
  std::string pieces;  // input of the client that the session has not consumed
  const auto drain = [&] {
    fuzz::require_messages(session.outgoing().text());
    session.outgoing().pop(session.outgoing().text().size());
  };
  while (!input.empty()) {
    const unsigned how = input.byte();
    if ((how & 3U) == 0) {  // a frame for the client
      static_cast<void>(rarm.computer_port().send(input.frame()));
    } else if ((how & 3U) == 1) {
      const Time pause = input.pause();
      wall += pause;
      rarm.advance(rarm.now() + pause);
      session.forward(wall);
      if ((how & 4U) == 0) drain();  // otherwise a client that does not read
    } else {
      pieces += input.text(how >> 2U);
      std::string_view left = pieces;
      SocketcandSession::Step step = SocketcandSession::Step::kDone;
      while (step == SocketcandSession::Step::kDone) {
        const std::size_t before = left.size();
        step = session.step(left, wall);
        fuzz::require(step != SocketcandSession::Step::kDone || left.size() < before, "a message is used up");
      }
      drain();
      if (step == SocketcandSession::Step::kClosed) return 0;
      fuzz::require(step != SocketcandSession::Step::kNeedMore || left.empty(), "all input is used up");
      pieces.erase(0, pieces.size() - left.size());
      if (pieces.size() > 1024) return 0;  // a blocked bus
    }
  }
  return 0;
}
