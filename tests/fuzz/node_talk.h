#pragma once

#include <algorithm>
#include <functional>

#include "drivers/canopen/cob_id.h"
#include "emulator/bus/frame_length.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "tests/fuzz/input.h"

namespace walkman::fuzz {

/// The bus as seen by one node: gives it frames and time as `bus::CanBus` does, and checks what it sends.
class NodeTalk {
 public:
  /// Powers the node on.
  NodeTalk(nodes::CanopenSlave& node, bool fd) : node_(node), fd_(fd) { node_.advance(now_); }

  /// Advances time, running every timer when it is due. `busy`: the bus accepts no frames of the node
  /// meanwhile.
  void wait(Time pause, bool busy) {
    constexpr int kMostAtOnce = 100;  // events at one instant
    const Time until = now_ + pause;
    for (int events = 0; node_.next_event() <= until; ++events) {
      if (node_.next_event() > now_) events = 0;
      now_ = std::max(now_, node_.next_event());
      node_.advance(now_);
      require(events < kMostAtOnce, "a node's timers let time go on");
      if (!busy) take_all();
    }
    now_ = until;
    if (!busy) take_all();
  }
  /// A frame of another participant has been transmitted.
  void hear(const can::Frame& frame) {
    if (bus::is_sendable(frame) && (fd_ || !frame.fd)) node_.receive(frame, now_);
  }
  void link(can::LinkState state) { node_.on_link_state(state, now_); }

  /// Called with each frame that the node sends.
  std::function<void(const can::Frame&)> heard = [](const can::Frame&) {};

 private:
  void take_all() {
    constexpr int kMostInARow = 20'000;  // a block upload of the longest domain has 18 725 segments
    for (int sent = 0; node_.pending() != nullptr; ++sent) {
      require(sent < kMostInARow, "a node comes to an end of what it sends");
      const can::Frame frame = *node_.pending();
      require(bus::is_sendable(frame) && !frame.extended && (fd_ || !frame.fd),
              "a node sends what its bus can carry");
      node_.take();
      heard(frame);
      if (node_.next_event() <= now_) node_.advance(now_);
    }
  }

  nodes::CanopenSlave& node_;
  bool fd_;
  Time now_{};
};

/// Uses the whole input as pauses and frames, with changes of the controller's state in place of its reports.
/// `each` is called after each pause.
template <typename Each>
void talk_to(nodes::CanopenSlave& node, Input& input, bool fd, const Each& each) {
  NodeTalk talk(node, fd);
  while (!input.empty()) {
    const unsigned how = input.byte();
    const Time pause = input.pause();
    talk.wait(pause, (how & 1U) != 0);
    each(pause);
    const can::Frame frame = input.frame();
    if (frame.error) {
      talk.link(static_cast<can::LinkState>(frame.id % 4));
    } else {
      talk.hear(frame);
    }
  }
  talk.wait(std::chrono::milliseconds(1), false);
  // Whatever it received, the node is there again after a power cycle, unless it was told to have no node-ID.
  bool there = false;
  talk.heard = [&](const can::Frame& frame) {
    there = there || frame.id == canopen::cob_id::error_control(node.node_id());
  };
  talk.link(can::LinkState::kActive);
  node.restart();
  talk.wait(std::chrono::milliseconds(1), false);
  require(there || node.node_id() > 127, "a node that starts again says so");
}

}  // namespace walkman::fuzz
