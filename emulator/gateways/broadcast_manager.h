#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::gateways {

/// What Linux's broadcast manager (linux/can/bcm.h) does for one program: sends frames at intervals, and
/// passes on those received frames that were asked for, when their content changes, and not too often.
///
/// Frames are told apart by identifier and its length. Classical data frames only. All times are the bus's.
class BroadcastManager {
 public:
  /// Of send jobs, and of subscriptions.
  static constexpr std::size_t kMaxJobs = 256;
  using Mask = std::array<std::uint8_t, 8>;

  /// Sends `frame` now and, unless `interval` is zero, then at every interval; in place of the job with the
  /// same identifier, if there is one. False when there are too many jobs. Allocates.
  [[nodiscard]] bool add(const can::Frame& frame, Time interval, Time now);
  /// New content for the job with this identifier, if there is one; its times stay.
  void update(const can::Frame& frame) noexcept;
  void remove(const can::Frame& identifier) noexcept;

  /// Received frames with this identifier are wanted, whatever they hold, at most one per `interval`, the
  /// newest. Replaces what was wanted of this identifier. False when there are too many. Allocates.
  [[nodiscard]] bool subscribe(const can::Frame& identifier, Time interval);
  /// As above, but only when content under `mask` differs from the frame passed on before.
  [[nodiscard]] bool filter(const can::Frame& identifier, Time interval, const Mask& mask);
  /// As above, of multiplexed content: the first mask says where the multiplexer is, each of the others
  /// holds its value there and the mask of what is to differ elsewhere. Frames with other values are not
  /// wanted. At least two masks.
  [[nodiscard]] bool filter_multiplexed(const can::Frame& identifier, Time interval,
                                        std::span<const Mask> masks);
  void unsubscribe(const can::Frame& identifier) noexcept;

  /// No jobs, no subscriptions.
  void clear() noexcept;

  /// The frame that is due to be sent; null when none is. Intervals that the bus had no room for are left
  /// out.
  [[nodiscard]] const can::Frame* due(Time now) noexcept;

  /// Whether this frame is to be passed on now. One that comes too soon is kept for `take_held`.
  [[nodiscard]] bool wants(const can::StampedFrame& frame) noexcept;
  /// Takes a frame whose interval is over by now; false when there is none.
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
    std::vector<Content> contents;  // of a multiplexed one the first is the multiplexer's mask
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
