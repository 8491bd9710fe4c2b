#include "tests/unit/drivers/fake_node.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

namespace walkman::test {

can::Frame frame(const std::string& text) {
  const auto hash = text.find('#');
  can::Frame result;
  result.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16));
  std::istringstream bytes(text.substr(hash + 1));
  std::string byte;
  while (bytes >> byte)
    result.data.at(result.length++) = static_cast<std::uint8_t>(std::stoul(byte, nullptr, 16));
  return result;
}

std::string text_of(const can::Frame& frame) {
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, "%03X#", frame.id);
  std::string text = buffer;
  if (frame.fd) text += "#";  // candump's "##" of an FD frame, without its flags
  for (int i = 0; i < frame.length; ++i) {
    std::snprintf(buffer, sizeof buffer, i == 0 ? "%02X" : " %02X",
                  frame.data.at(static_cast<std::size_t>(i)));
    text += buffer;
  }
  return text;
}

std::string cob(unsigned function_code, unsigned node, const std::string& bytes) {
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, "%03X#", function_code + node);
  return buffer + bytes;
}

FakeNode& FakeNode::add(Step step) {
  script_.push_back(std::move(step));
  return *this;
}
FakeNode& FakeNode::expect(const std::string& text) {
  return add({Step::Kind::kExpect, frame(text), {}, {}});
}
FakeNode& FakeNode::await(const std::string& text) { return add({Step::Kind::kAwait, frame(text), {}, {}}); }
FakeNode& FakeNode::answer(const std::string& text) {
  return add({Step::Kind::kAnswer, frame(text), {}, {}});
}
FakeNode& FakeNode::at(Time time) { return add({Step::Kind::kAt, {}, time, {}}); }
FakeNode& FakeNode::every(Time period, const std::string& text) {
  return add({Step::Kind::kEvery, frame(text), period, {}});
}
FakeNode& FakeNode::each_sync(std::function<Frames(int)> make) {
  return add({Step::Kind::kEachSync, {}, {}, std::move(make)});
}
FakeNode& FakeNode::each_sync(const std::vector<std::string>& texts) {
  Frames frames;
  for (const std::string& text : texts) frames.push_back(frame(text));
  return each_sync([frames](int) { return frames; });
}

void FakeNode::send(const can::Frame& frame, Time now) {
  if (!muted_) sent_.push_back({now, frame});
}

void FakeNode::run(Time now) {
  while (!script_.empty()) {
    Step& step = script_.front();
    switch (step.kind) {
      case Step::Kind::kExpect:
      case Step::Kind::kAwait:
        return;
      case Step::Kind::kAt:
        if (now < step.time) return;
        break;
      case Step::Kind::kAnswer:
        send(step.frame, now);
        break;
      case Step::Kind::kEachSync:
        sync_ = std::move(step.make);
        break;
      case Step::Kind::kEvery:
        periodic_.push_back({step.time, now, step.frame});
        break;
    }
    script_.pop_front();
  }
}

void FakeNode::hear(const can::Frame& sent, Time now) {
  if (sent.id == 0x080) {
    if (sync_) {
      for (const can::Frame& tpdo : sync_(syncs_)) send(tpdo, now);
    }
    ++syncs_;
    return;
  }
  const bool nmt = sent.id == 0x000 && (sent.data[1] == 0 || sent.data[1] == id_);
  const bool sdo = sent.id == 0x600 + id_;
  const bool rpdo = sent.id >= 0x200 && sent.id < 0x580 && (sent.id & 0x7FU) == id_;
  if (!nmt && !sdo && !rpdo) return;
  run(now);
  const bool waiting = !script_.empty();
  if (waiting && script_.front().kind == Step::Kind::kAwait) {
    if (!(script_.front().frame == sent)) return;
  } else if (rpdo) {
    return;
  } else if (!waiting || !(script_.front().frame == sent)) {
    complaints_.push_back("heard " + text_of(sent) + ", expected " +
                          (waiting ? text_of(script_.front().frame) : "nothing"));
    return;
  }
  script_.pop_front();
  run(now);
}

void FakeNode::tick(Time now) {
  run(now);
  for (Periodic& periodic : periodic_) {
    for (; periodic.due <= now; periodic.due += periodic.period) send(periodic.frame, periodic.due);
  }
}

std::vector<can::StampedFrame> FakeNode::take() {
  std::vector<can::StampedFrame> taken;
  taken.swap(sent_);
  return taken;
}

void FakeBus::collect() {
  std::vector<can::StampedFrame> batch;
  for (BusNode* node : nodes_) {
    for (const can::StampedFrame& stamped : node->take()) batch.push_back(stamped);
  }
  std::stable_sort(batch.begin(), batch.end(), [](const auto& a, const auto& b) {
    return a.time != b.time ? a.time < b.time : a.frame.id < b.frame.id;
  });
  Time offset{};
  for (can::StampedFrame& stamped : batch) {
    offset += std::chrono::microseconds(100);
    stamped.time += offset;
    received_.push_back(stamped);
  }
}

void FakeBus::tick(Time now) {
  now_ = now;
  for (BusNode* node : nodes_) node->tick(now);
  collect();
}

can::SendResult FakeBus::send(const can::Frame& frame) noexcept {
  if (result != can::SendResult::kQueued) return result;
  if (frame.fd && !fd) return can::SendResult::kInvalid;
  sent.push_back(frame);
  for (BusNode* node : nodes_) node->hear(frame, now_);
  collect();
  return result;
}

bool FakeBus::receive(can::StampedFrame& out) noexcept {
  if (received_.empty()) return false;
  out = received_.front();
  received_.pop_front();
  if (filter) filter(out.frame);
  return true;
}

std::vector<std::string> FakeBus::sent_with(std::uint32_t id) const {
  std::vector<std::string> texts;
  for (const can::Frame& one : sent) {
    if (one.id == id) texts.push_back(text_of(one));
  }
  return texts;
}

}  // namespace walkman::test
