#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/bus/can_bus.h"

namespace walkman::nodes {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Parses "185#3706" into a frame; "705#R" is a remote frame.
inline can::Frame frame_of(const std::string& text) {
  can::Frame frame;
  const auto hash = text.find('#');
  frame.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16));
  const std::string data = text.substr(hash + 1);
  if (data == "R") {
    frame.remote = true;
    return frame;
  }
  for (std::size_t i = 0; i + 1 < data.size(); i += 2) {
    frame.data[frame.length++] = static_cast<std::uint8_t>(std::stoul(data.substr(i, 2), nullptr, 16));
  }
  return frame;
}

inline std::string text_of(const can::Frame& frame) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%03X#", frame.id);
  std::string text = buffer;
  for (const std::uint8_t byte : frame.payload()) {
    std::snprintf(buffer, sizeof buffer, "%02X", byte);
    text += buffer;
  }
  return text;
}

using Frames = std::vector<std::string>;

/// A computer that talks to one node on a bus in literal frames.
class Conversation {
 public:
  explicit Conversation(bus::Participant& node) { bus.attach(node); }

  void send(const std::string& text) { static_cast<void>(bus.computer_port().send(frame_of(text))); }

  /// Returns everything received within `duration` from now.
  std::vector<can::StampedFrame> listen_stamped(Time duration) {
    bus.advance(bus.now() + duration);
    std::vector<can::StampedFrame> heard;
    can::StampedFrame frame;
    while (bus.computer_port().receive(frame)) heard.push_back(frame);
    return heard;
  }
  Frames listen(Time duration) {
    Frames heard;
    for (const auto& frame : listen_stamped(duration)) heard.push_back(text_of(frame.frame));
    return heard;
  }
  /// Sends a frame and returns what is received within 2 ms.
  Frames ask(const std::string& text) {
    send(text);
    return listen(milliseconds(2));
  }

  bus::CanBus bus{"test", "can_test"};
};

}  // namespace walkman::nodes
