#include "emulator/pacing/real_time_pacer.h"

#include <algorithm>

namespace walkman::pacing {

RealTimePacer::RealTimePacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, const Options& options,
                             PacerEvents events)
    : emulator_(&emulator),
      bridges_(std::move(bridges)),
      arrived_(bridges_.size()),
      bus_timing_(options.bus_timing),
      events_(std::move(events)),
      schedule_(Emulator::kPhysicsStep, options.stalls) {}

void RealTimePacer::start(Time host_now) { schedule_.start(host_now, emulator_->now()); }

bool RealTimePacer::enter() noexcept {
  bool any = false;
  can::Frame frame;
  for (std::size_t i = 0; i < bridges_.size(); ++i) {
    if (!arrived_[i]) continue;
    arrived_[i] = false;
    for (any = true; bridges_[i]->receive(frame);) bridges_[i]->enter(frame);
  }
  return any;
}

void RealTimePacer::run(Time host_now) {
  schedule_.skip_stall(emulator_->now(), host_now);
  carry(host_now);  // first: frames that arrived now were not on the bus before
  if (enter()) carry(host_now);
  hand_out();
  if (schedule_.due(emulator_->now(), host_now)) {
    schedule_.begin_step(emulator_->now(), host_now);
    emulator_->advance(emulator_->now() + Emulator::kPhysicsStep);
    carry(host_now);
    hand_out();
    if (events_.published_at) events_.published_at(emulator_->now());
  }
}

Time RealTimePacer::wake_at() const noexcept {
  Time next = emulator_->now() + Emulator::kPhysicsStep;
  if (!bus_timing_) return schedule_.host(next);
  // Only a bus with something left to finish requires waking before the step.
  for (const bus::Bridge* bridge : bridges_) {
    if (!bridge->bus().quiet()) next = std::min(next, bridge->bus().next_event());
  }
  return schedule_.host(next);
}

Time RealTimePacer::behind(Time host_now) const noexcept {
  return std::max(Time{}, schedule_.emulated(host_now) - emulator_->buses_now());
}

void RealTimePacer::carry(Time host_now) noexcept {
  // Never backwards: a step that ended ahead of its time has already advanced the buses.
  emulator_->carry(std::max(schedule_.emulated(host_now), emulator_->buses_now()));
  if (events_.moved) events_.moved();
}

void RealTimePacer::hand_out() noexcept {
  for (bus::Bridge* bridge : bridges_) (void)bridge->hand_out();  // the rest is handed out with the next step
}

}  // namespace walkman::pacing
