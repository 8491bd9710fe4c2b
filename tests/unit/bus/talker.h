#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "emulator/bus/participant.h"

namespace walkman::bus {

/// A participant that sends the frames it is given and records the frames it receives; has one timer.
class Talker : public Participant {
 public:
  void say(const can::Frame& frame) { queue_.push_back(frame); }
  void at(Time time, const can::Frame& frame) {
    due_ = time;
    timed_ = frame;
  }

  void receive(const can::Frame& frame, Time now) noexcept override { heard.push_back({now, frame}); }
  void advance(Time now) noexcept override {
    if (due_ > now) return;
    fired.push_back(now);
    due_ = Time::max();
    queue_.push_back(timed_);
  }
  Time next_event() const noexcept override { return due_; }
  const can::Frame* pending() const noexcept override { return queue_.empty() ? nullptr : &queue_.front(); }
  void take() noexcept override {
    queue_.pop_front();
    ++taken;
  }
  void on_link_state(can::LinkState state, Time now) noexcept override { states.emplace_back(state, now); }
  bool one_shot() const noexcept override { return sends_once; }
  bool restarts() const noexcept override { return comes_back; }
  std::uint64_t transmit_overflows() const noexcept override { return 0; }

  std::vector<std::uint32_t> heard_ids() const {
    std::vector<std::uint32_t> ids;
    for (const auto& frame : heard) ids.push_back(frame.frame.id);
    return ids;
  }

  std::vector<can::StampedFrame> heard;
  std::vector<Time> fired;
  std::vector<std::pair<can::LinkState, Time>> states;
  int taken = 0;
  bool sends_once = false;
  bool comes_back = true;

 private:
  std::deque<can::Frame> queue_;
  Time due_ = Time::max();
  can::Frame timed_;
};

}  // namespace walkman::bus
