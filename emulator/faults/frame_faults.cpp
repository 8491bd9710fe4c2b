#include "emulator/faults/frame_faults.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <initializer_list>
#include <optional>
#include <utility>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"
#include "drivers/canopen/sdo.h"

namespace walkman::faults {
namespace {

// Functions of the predefined connection set (CiA 301, 7.3.5): the identifier without the node-ID.
constexpr std::uint32_t kNodeBits = 0x7F;
constexpr std::uint32_t kSdoResponse = canopen::cob_id::sdo_response(0);
constexpr std::uint32_t kErrorControl = canopen::cob_id::error_control(0);

constexpr std::uint32_t function_of(const can::Frame& frame) noexcept { return frame.id & ~kNodeBits; }

/// Number of the TPDO; 0 for any other frame.
constexpr int tpdo_of(const can::Frame& frame) noexcept {
  for (int number = 1; number <= 4; ++number)
    if (function_of(frame) == canopen::cob_id::tpdo(number, 0)) return number;
  return 0;
}

/// RPDOs and SDO requests: the frames that a master sends to one device.
constexpr bool is_to_device(const can::Frame& frame) noexcept {
  for (int number = 1; number <= 4; ++number)
    if (function_of(frame) == canopen::cob_id::rpdo(number, 0)) return true;
  return function_of(frame) == canopen::cob_id::sdo_request(0);
}

constexpr std::size_t kHeld = 4096;  // frames held back at most; more are lost

/// Draws which of the frames, by their share, are affected.
class Draw {
 public:
  Draw(std::uint64_t seed, double share) : generator_(seed), share_(share) {}
  [[nodiscard]] bool one() noexcept { return share_ >= 1 || uniform_(generator_) < share_; }
  [[nodiscard]] int below(int end) noexcept {
    return std::min(end - 1, static_cast<int>(uniform_(generator_) * end));
  }
  [[nodiscard]] Time below(Time end) noexcept {
    if (end <= Time{}) return {};
    return Time(static_cast<std::int64_t>(uniform_(generator_) * static_cast<double>(end.count())));
  }

 private:
  std::mt19937_64 generator_;
  double share_;
  std::uniform_real_distribution<double> uniform_;
};

class Drop final : public FrameFault {
 public:
  Drop(const FrameFault& base, std::uint64_t seed, double share) : FrameFault(base), draw_(seed, share) {}
  [[nodiscard]] bool ends(can::Frame&, Time) noexcept override {
    if (!draw_.one()) return true;
    touch();
    return false;
  }

 private:
  Draw draw_;
};

class BurstLoss final : public FrameFault {
 public:
  BurstLoss(const FrameFault& base, double frames)
      : FrameFault(base), frames_(static_cast<std::uint64_t>(frames)) {}
  void start() noexcept override { left_ = frames_; }
  [[nodiscard]] bool ends(can::Frame&, Time) noexcept override {
    if (left_ == 0) return true;
    --left_;
    touch();
    return false;
  }

 private:
  std::uint64_t frames_, left_ = 0;
};

/// A controller that delivers frames late, twice or in another order.
class Queueing final : public FrameFault {
 public:
  enum class How { kLater, kTwice, kBehindTheNext };

  Queueing(const FrameFault& base, How how, bus::CanBus& bus, Time delay, Time jitter, std::uint64_t seed,
           double share)
      : FrameFault(base),
        how_(how),
        bus_(bus),
        delay_(delay),
        jitter_(jitter),
        draw_(seed, share),
        held_(kHeld) {}

  [[nodiscard]] bool ends(can::Frame& frame, Time now) noexcept override {
    if (how_ == How::kBehindTheNext && !held_.empty()) {
      // Delivered here, before the held frame: whoever receives both gets the newer one first.
      bus_.hand_over(frame, bus_.sender());
      release();
      return false;
    }
    if (!draw_.one()) return true;
    touch();
    if (how_ == How::kTwice) {
      bus_.hand_over(frame, bus_.sender());
      return true;
    }
    last_ = std::max(last_, now + delay_ + draw_.below(jitter_));
    static_cast<void>(held_.push({last_, frame, &bus_.sender()}));
    return false;
  }
  /// Delivers the frames still held back.
  void finish() noexcept override {
    while (!held_.empty()) release();
  }
  void step(Time now) noexcept override {
    while (how_ == How::kLater && !held_.empty() && held_.front().due <= now) release();
  }

 private:
  struct Held {
    Time due{};
    can::Frame frame;
    const bus::Participant* sender = nullptr;
  };
  void release() noexcept {
    bus_.hand_over(held_.front().frame, *held_.front().sender);
    held_.pop();
  }
  How how_;
  bus::CanBus& bus_;
  Time delay_, jitter_, last_{};  // `last_`: when the newest is due
  Draw draw_;
  bus::Ring<Held> held_;
};

class BitFlip final : public FrameFault {
 public:
  BitFlip(const FrameFault& base, int bits, std::uint64_t seed, double share)
      : FrameFault(base), bits_(bits), draw_(seed, share) {}
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    if (frame.length == 0 || !draw_.one()) return true;
    touch();
    // Different bits, since two flips of one cancel: Floyd's sampling without replacement.
    std::bitset<8 * can::kMaxPayload> flipped;
    const int all = 8 * frame.length;
    for (int last = std::max(0, all - bits_); last < all; ++last) {
      const int drawn = draw_.below(last + 1);
      const auto bit = static_cast<std::size_t>(flipped[static_cast<std::size_t>(drawn)] ? last : drawn);
      flipped.set(bit);
      frame.data[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
    return true;
  }

 private:
  int bits_;
  Draw draw_;
};

class WrongLength final : public FrameFault {
 public:
  WrongLength(const FrameFault& base, int bytes, std::uint64_t seed, double share)
      : FrameFault(base), bytes_(bytes), draw_(seed, share) {}
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    const int length = std::clamp(frame.length + bytes_, 0, 8);
    if (frame.fd || length == frame.length || !draw_.one()) return true;
    touch();
    frame.length = static_cast<std::uint8_t>(length);
    return true;
  }

 private:
  int bytes_;
  Draw draw_;
};

/// A port of its own for one fault, until that is gone.
using PortLease = std::unique_ptr<bus::ComputerPort, std::function<void(bus::ComputerPort*)>>;

/// An unsolicited frame, sent repeatedly or once.
class Babble final : public FrameFault {
 public:
  static constexpr double kOnce = 0;
  /// Frames that wait for the bus at most: those that fit into a physics step at 1 Mbit/s, and one more.
  static constexpr std::size_t kWaiting = 22;

  Babble(const FrameFault& base, PortLease port, const can::Frame& frame, double rate)
      : FrameFault(base), port_(std::move(port)), frame_(frame), rate_(rate) {}
  void start() noexcept override { owed_ = 1; }
  void step(Time) noexcept override {
    for (; owed_ >= 1; owed_ -= 1)
      if (port_->queued() < kWaiting && port_->send(frame_) == can::SendResult::kQueued) touch();
    owed_ += rate_ * 1e-3;  // a physics step is a millisecond
  }
  /// What still waits for the bus is not sent.
  void finish() noexcept override {
    port_->set_host_side(bus::HostSide::kDown);
    port_->set_host_side(bus::HostSide::kSound);
  }

 private:
  PortLease port_;
  can::Frame frame_;
  double rate_, owed_ = 0;
};

can::Frame frame_of(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
  can::Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

/// Command of a foreign master, by its number in `rogue-master`.
can::Frame foreign_command(int command, std::uint8_t node) {
  constexpr std::uint8_t kAllNodes = 0;
  switch (command) {
    case 3: {
      constexpr std::uint8_t kUpload = 0x40;
      can::Frame frame = frame_of(canopen::cob_id::sdo_request(node), {kUpload, 0, 0, 0, 0, 0, 0, 0});
      canopen::put(frame.data.data() + 1, canopen::object::kDeviceType);
      return frame;
    }
    case 4:
      return frame_of(canopen::cob_id::rpdo(1, node), {0, 0, 0, 0, 0, 0, 0, 0});
    case 1:
      return frame_of(canopen::cob_id::kSync, {});
    case 2:
      return frame_of(canopen::cob_id::kNmt,
                      {static_cast<std::uint8_t>(canopen::NmtCommand::kResetNode), kAllNodes});
    default:
      return frame_of(canopen::cob_id::kNmt,
                      {static_cast<std::uint8_t>(canopen::NmtCommand::kStop), kAllNodes});
  }
}

/// Changes the value that an SDO server answers with when one object is read (CiA 301, 7.2.4.3.5).
class AlteredAnswer final : public FrameFault {
 public:
  AlteredAnswer(const FrameFault& base, canopen::ObjectAddress object) : FrameFault(base), object_(object) {}
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    constexpr std::uint8_t kUploadExpedited = 0x43, kCommand = 0xE3;
    if (function_of(frame) != kSdoResponse || frame.length != 8) return true;
    if ((frame.data[0] & kCommand) != kUploadExpedited) return true;
    if (canopen::get<std::uint16_t>(frame.data.data() + 1) != object_.index) return true;
    if (frame.data[3] != object_.sub) return true;
    frame.data[4] = static_cast<std::uint8_t>(frame.data[4] + 1);
    touch();
    return true;
  }

 private:
  canopen::ObjectAddress object_;
};

/// Inverts the toggle bit in segments of an SDO server's answers (CiA 301, 7.2.4.3.4 and 7.2.4.3.7).
class WrongToggle final : public FrameFault {
 public:
  explicit WrongToggle(const FrameFault& base) : FrameFault(base) {}
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    constexpr std::uint8_t kDownloadSegment = 0x20, kUploadSegment = 0x00, kCommand = 0xE0, kToggle = 0x10;
    if (function_of(frame) != kSdoResponse || frame.length != 8) return true;
    const int command = frame.data[0] & kCommand;
    if (command != kDownloadSegment && command != kUploadSegment) return true;
    frame.data[0] ^= kToggle;
    touch();
    return true;
  }
};

/// Every frame of a participant ends in an error frame, or just enough of them to keep its transmit error
/// counter at `errors`.
class Broken final : public FrameFault {
 public:
  static constexpr int kToTheEnd = 256;  // ISO 11898-1, fault confinement: bus-off

  Broken(const FrameFault& base, const bus::CanBus& bus, const bus::Participant& sender, int errors)
      : FrameFault(base), bus_(bus), sender_(sender), errors_(errors) {}
  [[nodiscard]] bus::FrameFate begins(const can::Frame&, Time) noexcept override {
    if (&bus_.sender() != &sender_) return bus::FrameFate::deliver();
    if (errors_ < kToTheEnd && bus_.error_counters(sender_).transmit >= errors_)
      return bus::FrameFate::deliver();
    touch();
    constexpr int kInTheIdentifier = 5;
    return bus::FrameFate::corrupt(kInTheIdentifier);
  }

 private:
  const bus::CanBus& bus_;
  const bus::Participant& sender_;
  int errors_;
};

class NoAcknowledge final : public FrameFault {
 public:
  explicit NoAcknowledge(const FrameFault& base) : FrameFault(base) {}
  [[nodiscard]] bus::FrameFate begins(const can::Frame&, Time) noexcept override {
    touch();
    return bus::FrameFate::no_acknowledge();
  }
};

/// Loses the frames of one function of a device.
class LostFunction final : public FrameFault {
 public:
  LostFunction(const FrameFault& base, std::uint32_t function) : FrameFault(base), function_(function) {}
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    if (function_of(frame) != function_) return true;
    touch();
    return false;
  }

 private:
  std::uint32_t function_;
};

/// Each TPDO keeps the bytes of the first frame that comes.
class FrozenPdos final : public FrameFault {
 public:
  explicit FrozenPdos(const FrameFault& base) : FrameFault(base) {}
  void start() noexcept override { kept_ = {}; }
  [[nodiscard]] bool ends(can::Frame& frame, Time) noexcept override {
    const int number = tpdo_of(frame);
    if (number == 0) return true;
    auto& kept = kept_[static_cast<std::size_t>(number - 1)];
    if (!kept) kept = frame;
    if (kept->length == frame.length && !(*kept == frame)) touch();
    frame = *kept;
    return true;
  }

 private:
  std::array<std::optional<can::Frame>, 4> kept_;
};

}  // namespace

bool FrameFault::concerns(const can::Frame& frame) const noexcept {
  if (frame.error) return false;
  if (node_ == 0) return true;
  if (frame.extended || (frame.id & kNodeBits) != node_) return false;
  return direction_ == Direction::kBoth || is_to_device(frame) == (direction_ == Direction::kTo);
}

BusFaults::BusFaults(bus::CanBus& bus) : bus_(bus) {
  bus.set_fault_port([this](const can::Frame& frame, Time now) {
    bus::FrameFate fate = bus::FrameFate::deliver();
    for (FrameFault* fault : active_) {
      if (!fault->concerns(frame)) continue;
      if (const bus::FrameFate wanted = fault->begins(frame, now);
          wanted.kind != bus::FrameFate::Kind::kDeliver)
        fate = wanted;
    }
    return fate;
  });
  bus.set_filter([this](can::Frame& frame, Time now) {
    count(frame, now);
    bool passes = true;
    for (FrameFault* fault : active_)
      if (passes && fault->concerns(frame)) passes = fault->ends(frame, now);
    return passes;
  });
}

void BusFaults::count(const can::Frame& frame, Time now) {
  if (frame.error || frame.extended) return;
  for (Awaited& one : awaited_)
    if (one.id == frame.id && one.left > 0 && --one.left == 0) one.reached(now);
}

void BusFaults::step(Time now) noexcept {
  for (FrameFault* fault : active_) fault->step(now);
}

std::unique_ptr<FrameFault> BusFaults::make(const Injection& injection, std::uint8_t node,
                                            const bus::Participant* participant) {
  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  const auto seconds = [](double s) { return Time(static_cast<std::int64_t>(s * 1e9)); };
  const auto port = [this] {
    if (idle_ports_.empty()) idle_ports_.push_back(&bus_.add_port());
    bus::ComputerPort* const idle = idle_ports_.back();
    idle_ports_.pop_back();
    return PortLease(idle, [this](bus::ComputerPort* used) { idle_ports_.push_back(used); });
  };
  const std::uint64_t stream = injection.stream_seed();
  const bool own_frames = injection.kind->target == Target::kDevice;
  const FrameFault base(node, own_frames ? Direction::kFrom : injection.direction);
  if (name == "frame-drop") return std::make_unique<Drop>(base, stream, value("share"));
  if (name == "frame-burst-loss") return std::make_unique<BurstLoss>(base, value("frames"));
  if (name == "frame-delay")
    return std::make_unique<Queueing>(base, Queueing::How::kLater, bus_, seconds(value("delay")),
                                      seconds(value("jitter")), stream, value("share"));
  if (name == "frame-duplicate")
    return std::make_unique<Queueing>(base, Queueing::How::kTwice, bus_, Time{}, Time{}, stream,
                                      value("share"));
  if (name == "frame-reorder")
    return std::make_unique<Queueing>(base, Queueing::How::kBehindTheNext, bus_, Time{}, Time{}, stream,
                                      value("share"));
  if (name == "payload-bitflip")
    return std::make_unique<BitFlip>(base, static_cast<int>(value("bits")), stream, value("share"));
  if (name == "wrong-length")
    return std::make_unique<WrongLength>(base, static_cast<int>(value("bytes")), stream, value("share"));
  if (name == "babbling-idiot")
    return std::make_unique<Babble>(
        base, port(), frame_of(static_cast<std::uint32_t>(value("id")), {0, 0, 0, 0, 0, 0, 0, 0}),
        value("rate"));
  if (name == "rogue-master") {
    const int command = static_cast<int>(value("command"));
    const bool once = command == 0 || command == 2;
    return std::make_unique<Babble>(base, port(),
                                    foreign_command(command, static_cast<std::uint8_t>(value("node"))),
                                    once ? Babble::kOnce : value("rate"));
  }
  if (name == "emergency-storm") {
    const auto code = static_cast<std::uint16_t>(value("code"));
    return std::make_unique<Babble>(
        base, port(),
        frame_of(canopen::cob_id::emcy(node),
                 {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8U), 1, 0, 0, 0, 0, 0}),
        value("rate"));
  }
  if (name == "wrong-identity")
    return std::make_unique<AlteredAnswer>(
        base, canopen::ObjectAddress{canopen::object::kIdentity, static_cast<std::uint8_t>(value("sub"))});
  if (name == "no-acknowledge") return std::make_unique<NoAcknowledge>(base);
  if (name == "heartbeat-loss") return std::make_unique<LostFunction>(base, kErrorControl);
  if (name == "sdo-toggle-error") return std::make_unique<WrongToggle>(base);
  if (name == "sdo-timeout") return std::make_unique<LostFunction>(base, kSdoResponse);
  if (name == "pdo-frozen") return std::make_unique<FrozenPdos>(base);
  if (name == "computer-bus-off")
    return std::make_unique<Broken>(base, bus_, bus_.computer_port(), Broken::kToTheEnd);
  if (participant != nullptr && name == "bus-off")
    return std::make_unique<Broken>(base, bus_, *participant, Broken::kToTheEnd);
  if (participant != nullptr && name == "error-passive")
    return std::make_unique<Broken>(base, bus_, *participant, static_cast<int>(value("errors")));
  return nullptr;
}

}  // namespace walkman::faults
