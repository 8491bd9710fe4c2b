#include "emulator/clock/real_time_pacer.h"

#include <algorithm>

namespace walkman::clock {

RealTimePacer::RealTimePacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, EventLoop& loop,
                             bool bus_timing, PacerEvents events)
    : emulator_(&emulator),
      bridges_(std::move(bridges)),
      loop_(&loop),
      bus_timing_(bus_timing),
      events_(std::move(events)) {}

void RealTimePacer::start(Time host_now) {
  schedule_.start(host_now, emulator_->now());
  loop_->set_tick(schedule_.host(emulator_->now() + Emulator::kPhysicsStep), Emulator::kPhysicsStep);
}

void RealTimePacer::receive(std::size_t bridge) noexcept {
  can::Frame frame;
  while (bridges_[bridge]->receive(frame)) bridges_[bridge]->enter(frame);
}

bool RealTimePacer::run(Time host_now) {
  carry(host_now);
  hand_out();
  if (schedule_.due(emulator_->now(), host_now)) {
    schedule_.begin_step(emulator_->now(), host_now);
    emulator_->advance(emulator_->now() + Emulator::kPhysicsStep);
    carry(host_now);
    hand_out();
    if (events_.published_at) events_.published_at(emulator_->now());
  }
  set_alarm(host_now);
  return schedule_.due(emulator_->now(), host_now);
}

Time RealTimePacer::behind(Time host_now) const noexcept {
  return std::max(Time{}, schedule_.emulated(host_now) - emulator_->buses_now());
}

void RealTimePacer::carry(Time host_now) noexcept {
  // Never back: a step that ended before its time has taken the buses along.
  emulator_->carry(std::max(schedule_.emulated(host_now), emulator_->buses_now()));
  if (events_.moved) events_.moved();
}

void RealTimePacer::hand_out() noexcept {
  for (bus::Bridge* bridge : bridges_) (void)bridge->hand_out();  // what remains goes with the next step
}

void RealTimePacer::set_alarm(Time host_now) {
  if (!bus_timing_) return;
  // The next tick comes anyway; only a bus that has something to finish before it needs waking for.
  Time next = Time::max();
  for (const bus::Bridge* bridge : bridges_) {
    if (!bridge->bus().quiet()) next = std::min(next, bridge->bus().next_event());
  }
  if (next != Time::max()) next = schedule_.host(next);
  if (next >= schedule_.host(emulator_->now() + Emulator::kPhysicsStep) || next <= host_now) next = Time::max();
  if (next == alarm_) return;
  loop_->set_alarm(next);
  alarm_ = next;
}

}  // namespace walkman::clock
