#include "emulator/gateways/broadcast_manager.h"

#include <algorithm>
#include <utility>

namespace walkman::gateways {
namespace {

bool same_identifier(const can::Frame& a, const can::Frame& b) noexcept {
  return a.id == b.id && a.extended == b.extended && a.remote == b.remote;
}

BroadcastManager::Mask content_of(const can::Frame& frame) noexcept {
  BroadcastManager::Mask content{};
  std::copy_n(frame.data.begin(), frame.remote ? 0 : std::min<std::size_t>(frame.length, 8), content.begin());
  return content;
}

BroadcastManager::Mask operator&(const BroadcastManager::Mask& a, const BroadcastManager::Mask& b) noexcept {
  BroadcastManager::Mask out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = a[i] & b[i];
  return out;
}

}  // namespace

bool BroadcastManager::add(const can::Frame& frame, Time interval, Time now) {
  remove(frame);
  if (jobs_.size() == kMaxJobs) return false;
  jobs_.push_back({frame, interval, now});
  return true;
}

void BroadcastManager::update(const can::Frame& frame) noexcept {
  for (Job& job : jobs_) {
    if (same_identifier(job.frame, frame)) job.frame = frame;
  }
}

void BroadcastManager::remove(const can::Frame& identifier) noexcept {
  std::erase_if(jobs_, [&](const Job& job) { return same_identifier(job.frame, identifier); });
}

bool BroadcastManager::subscribe(const can::Frame& identifier, Time interval) {
  Subscription subscription;
  subscription.identifier = identifier;
  subscription.interval = interval;
  subscription.any_content = true;
  return set(std::move(subscription));
}

bool BroadcastManager::filter(const can::Frame& identifier, Time interval, const Mask& mask) {
  Subscription subscription;
  subscription.identifier = identifier;
  subscription.interval = interval;
  subscription.contents = {{.mask = mask}};
  return set(std::move(subscription));
}

bool BroadcastManager::filter_multiplexed(const can::Frame& identifier, Time interval,
                                          std::span<const Mask> masks) {
  Subscription subscription;
  subscription.identifier = identifier;
  subscription.interval = interval;
  subscription.multiplexed = true;
  for (const Mask& mask : masks) subscription.contents.push_back({.mask = mask});
  return set(std::move(subscription));
}

bool BroadcastManager::set(Subscription subscription) {
  unsubscribe(subscription.identifier);
  if (subscriptions_.size() == kMaxJobs) return false;
  subscriptions_.push_back(std::move(subscription));
  return true;
}

void BroadcastManager::unsubscribe(const can::Frame& identifier) noexcept {
  std::erase_if(subscriptions_,
                [&](const Subscription& s) { return same_identifier(s.identifier, identifier); });
}

void BroadcastManager::clear() noexcept {
  jobs_.clear();
  subscriptions_.clear();
}

const can::Frame* BroadcastManager::due(Time now) noexcept {
  for (Job& job : jobs_) {
    if (job.next > now) continue;
    if (job.interval == Time{}) {
      job.next = Time::max();
    } else {
      job.next += job.interval * ((now - job.next) / job.interval + 1);
    }
    return &job.frame;
  }
  return nullptr;
}

bool BroadcastManager::changes(Subscription& subscription, const can::Frame& frame) noexcept {
  if (subscription.any_content) return true;
  const Mask content = content_of(frame);
  const std::size_t first = subscription.multiplexed ? 1 : 0;
  for (std::size_t i = first; i < subscription.contents.size(); ++i) {
    Content& wanted = subscription.contents[i];
    if (subscription.multiplexed) {
      const Mask& multiplexer = subscription.contents.front().mask;
      if ((multiplexer & content) != (multiplexer & wanted.mask)) continue;
    }
    const bool differs = !wanted.seen || (wanted.mask & content) != (wanted.mask & wanted.last);
    wanted.seen = true;
    if (differs) wanted.last = content;
    return differs;
  }
  return false;
}

bool BroadcastManager::wants(const can::StampedFrame& stamped) noexcept {
  const can::Frame& frame = stamped.frame;
  if (frame.fd || frame.error) return false;
  for (Subscription& subscription : subscriptions_) {
    if (!same_identifier(subscription.identifier, frame) || !changes(subscription, frame)) continue;
    const bool first = subscription.passed_at == Time::min();
    if (first || stamped.time - subscription.passed_at >= subscription.interval) {
      subscription.passed_at = stamped.time;
      subscription.holds = false;
      return true;
    }
    subscription.holds = true;
    subscription.held = stamped;
  }
  return false;
}

bool BroadcastManager::take_held(Time now, can::StampedFrame& out) noexcept {
  for (Subscription& subscription : subscriptions_) {
    if (!subscription.holds || now - subscription.passed_at < subscription.interval) continue;
    subscription.holds = false;
    subscription.passed_at = now;
    out = subscription.held;
    return true;
  }
  return false;
}

}  // namespace walkman::gateways
