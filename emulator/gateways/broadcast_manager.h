#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::gateways {

/// Does what Linux's broadcast manager (linux/can/bcm.h) does for one program: sends frames at intervals, and
/// passes on requested received frames when their content changes, at a limited rate.
///
/// Frames are distinguished by identifier and its length. Classical data frames only. All times are on the
/// bus's clock.
class BroadcastManager {
 public:
  /// Maximum number of send jobs, and of subscriptions.
  static constexpr std::size_t kMaxJobs = 256;
  using Mask = std::array<std::uint8_t, 8>;

  /// Sends `frame` now and, unless `interval` is zero, then at every interval; replaces the job with the same
  /// identifier, if there is one. Returns false if there are too many jobs. Allocates.
  [[nodiscard]] bool add(const can::Frame& frame, Time interval, Time now);
  /// Sets new content for the job with this identifier, if there is one; its timing is unchanged.
  void update(const can::Frame& frame) noexcept;
  void remove(const can::Frame& identifier) noexcept;

  /// Requests received frames with this identifier, with any content, at most one per `interval`, the newest.
  /// Replaces an earlier request for this identifier. Returns false if there are too many. Allocates.
  [[nodiscard]] bool subscribe(const can::Frame& identifier, Time interval);
  /// As above, but only if the content under `mask` differs from that of the frame passed on before.
  [[nodiscard]] bool filter(const can::Frame& identifier, Time interval, const Mask& mask);
  /// As above, for multiplexed content: the first mask gives the position of the multiplexer; each of the
  /// others holds a multiplexer value there, and elsewhere the mask of the content that must differ. Frames
  /// with other values are not requested. At least two masks.
  [[nodiscard]] bool filter_multiplexed(const can::Frame& identifier, Time interval,
                                        std::span<const Mask> masks);
  void unsubscribe(const can::Frame& identifier) noexcept;

  /// Removes all jobs and subscriptions.
  void clear() noexcept;

  /// Returns a frame that is due to be sent; null if there is none. Intervals for which the bus had no room
  /// are skipped.
  [[nodiscard]] const can::Frame* due(Time now) noexcept;

  /// Whether this frame is to be passed on now. One that comes too soon is kept for `take_held`.
  [[nodiscard]] bool wants(const can::StampedFrame& frame) noexcept;
  /// Takes a held frame whose interval is over by now; returns false if there is none.
  [[nodiscard]] bool take_held(Time now, can::StampedFrame& out) noexcept;

 private:
  struct Job {
    can::Frame frame;
    Time interval{};
    Time next{};
  };
  struct Content {
    Mask mask{};
    Mask last{};
    bool seen = false;
  };
  struct Subscription {
    can::Frame identifier;
    Time interval{};
    bool any_content = false;
    bool multiplexed = false;
    std::vector<Content> contents;  // if multiplexed, the first is the multiplexer's mask
    Time passed_at = Time::min();
    bool holds = false;
    can::StampedFrame held;
  };

  [[nodiscard]] bool set(Subscription subscription);
  [[nodiscard]] static bool changes(Subscription& subscription, const can::Frame& frame) noexcept;

  std::vector<Job> jobs_;
  std::vector<Subscription> subscriptions_;
};

}  // namespace walkman::gateways
