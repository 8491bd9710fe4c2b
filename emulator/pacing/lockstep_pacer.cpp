#include "emulator/pacing/lockstep_pacer.h"

#include <algorithm>

namespace walkman::pacing {
namespace {

// How long to wait for room in the kernel's transmit queue.
constexpr Time kRetry = std::chrono::milliseconds(1);

}  // namespace

LockstepPacer::LockstepPacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, Time period,
                             PacerEvents events)
    : emulator_(&emulator),
      bridges_(std::move(bridges)),
      inboxes_(bridges_.size(), period),
      events_(std::move(events)) {}

void LockstepPacer::start() {
  go_until_quiet(now() + Emulator::kPhysicsStep, now() + inboxes_.period());
  hand_out();
}

void LockstepPacer::receive(std::size_t bridge, Time wall_now) {
  can::Frame frame;
  while (bridges_[bridge]->receive(frame)) inboxes_.receive(bridge, frame, wall_now);
}

void LockstepPacer::run(Time wall_now) {
  while (inboxes_.cycle_ready()) cycle();
  if (wall_now >= inboxes_.incomplete_cycle_at()) cycle();
  if (wall_now >= inboxes_.serve_at(!quiet())) {
    serve();
    inboxes_.begin_quiet(wall_now);
  }
  hand_out();
}

Time LockstepPacer::wake_at(Time wall_now) const noexcept {
  const Time serve = std::min(inboxes_.serve_at(!quiet()), inboxes_.incomplete_cycle_at());
  return handed_out_ ? serve : std::min(serve, wall_now + kRetry);
}

void LockstepPacer::finish() {
  while (inboxes_.cycle_ready()) cycle();
  if (inboxes_.serve_at(!quiet()) != Time::max()) serve();
}

void LockstepPacer::cycle() {
  enter_waiting();
  const Time at = inboxes_.next_sync(now());
  go_to(at);
  inboxes_.note_sync(at);
  if (events_.published_at) events_.published_at(at);
  for (std::size_t i = 0; i < bridges_.size(); ++i) {
    if (inboxes_.has_sync(i)) bridges_[i]->enter(inboxes_.take_sync(i));
  }
  go_until_quiet(at, at + inboxes_.period());
  hand_out();
  ++cycles_;
}

void LockstepPacer::serve() {
  enter_waiting();
  // Within the current cycle as far as possible, so that its SYNC finds the same world, served or not.
  const Time limit = std::min(inboxes_.cycle_end(now()), now() + inboxes_.period());
  if (inboxes_.clocked()) {
    go_until_quiet(now(), limit);
  } else {
    go_until_quiet(now() + Emulator::kPhysicsStep, limit);
    if (events_.published_at) events_.published_at(now());
  }
  hand_out();
}

void LockstepPacer::enter_waiting() {
  can::Frame frame;
  for (std::size_t i = 0; i < bridges_.size(); ++i) {
    while (inboxes_.take_before_sync(i, frame)) bridges_[i]->enter(frame);
  }
}

void LockstepPacer::go_to(Time until) {
  emulator_->advance(until);
  emulator_->carry(until);
  if (events_.moved) events_.moved();
}

void LockstepPacer::go_until_quiet(Time at_least, Time limit) {
  go_to(std::max(now(), std::min(at_least, limit)));  // starts sending what waits
  while (!quiet() && now() < limit) {
    Time next = limit;
    for (const bus::Bridge* bridge : bridges_) {
      if (!bridge->bus().quiet()) next = std::min(next, bridge->bus().next_event());
    }
    go_to(std::max(next, now() + Time(1)));
  }
}

void LockstepPacer::hand_out() {
  handed_out_ = true;
  for (bus::Bridge* bridge : bridges_) handed_out_ = bridge->hand_out() && handed_out_;
}

bool LockstepPacer::quiet() const noexcept {
  return std::all_of(bridges_.begin(), bridges_.end(),
                     [](const bus::Bridge* bridge) { return bridge->bus().quiet(); });
}

}  // namespace walkman::pacing
