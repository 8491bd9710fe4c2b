#pragma once

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::test {

/// Parses a frame in candump's notation, "18B#31 02 08 00 00": identifier and bytes in hexadecimal.
[[nodiscard]] can::Frame frame(const std::string& text);
[[nodiscard]] std::string text_of(const can::Frame& frame);
/// Returns "58B#" + bytes for function code 0x580 and node 11.
[[nodiscard]] std::string cob(unsigned function_code, unsigned node, const std::string& bytes);

/// A participant on the fake bus.
class BusNode {
 public:
  virtual ~BusNode() = default;
  /// Receives a frame that the master sent.
  virtual void hear(const can::Frame& sent, Time now) = 0;
  virtual void tick(Time now) = 0;
  /// Returns the frames sent since the last call.
  [[nodiscard]] virtual std::vector<can::StampedFrame> take() = 0;
};

/// A device that follows a script, written like a conversation:
///
///     node.expect("000#82 00").answer("70B#00").expect("60B#40 00 10 00 00 00 00 00").answer("58B#43 …");
///
/// It receives NMT commands to itself or to all nodes, its SDO requests and its RPDOs. `expect` compares the
/// next NMT or SDO frame; `await` skips everything until its frame arrives. It knows only bytes, no CANopen.
class FakeNode : public BusNode {
 public:
  using Frames = std::vector<can::Frame>;

  explicit FakeNode(unsigned id) : id_(id) {}

  FakeNode& expect(const std::string& text);
  FakeNode& await(const std::string& text);
  FakeNode& answer(const std::string& text);
  /// Continues no sooner than at this time.
  FakeNode& at(Time time);
  /// From here on, these frames follow every SYNC; `make` gets the number of the SYNC, counted from 0.
  FakeNode& each_sync(const std::vector<std::string>& texts);
  FakeNode& each_sync(std::function<Frames(int)> make);
  /// From here on, this frame is sent once per period, for the first time immediately.
  FakeNode& every(Time period, const std::string& text);

  void hear(const can::Frame& sent, Time now) override;
  /// Advances the time; `at` steps and periodic frames become due.
  void tick(Time now) override;
  [[nodiscard]] std::vector<can::StampedFrame> take() override;
  [[nodiscard]] bool done() const { return script_.empty(); }
  [[nodiscard]] const std::vector<std::string>& complaints() const { return complaints_; }

  void mute(bool muted) { muted_ = muted; }      ///< sends nothing while muted
  void forget_sync() { sync_ = nullptr; }        ///< stops the TPDOs
  void forget_periodic() { periodic_.clear(); }  ///< stops the heartbeat

 private:
  struct Step {
    enum class Kind { kExpect, kAwait, kAnswer, kAt, kEachSync, kEvery } kind;
    can::Frame frame;
    Time time{};
    std::function<Frames(int)> make;
  };
  struct Periodic {
    Time period{}, due{};
    can::Frame frame;
  };

  void run(Time now);
  void send(const can::Frame& frame, Time now);
  FakeNode& add(Step step);

  unsigned id_;
  std::deque<Step> script_;
  std::function<Frames(int)> sync_;
  int syncs_ = 0;
  std::vector<Periodic> periodic_;
  std::vector<can::StampedFrame> sent_;
  std::vector<std::string> complaints_;
  bool muted_ = false;
};

/// An in-memory bus interface with fake nodes on it. Frames from nodes carry the time at which they were
/// sent; those that follow a SYNC arrive in identifier order, 100 µs apart.
class FakeBus final : public can::Interface {
 public:
  explicit FakeBus(std::string name) : name_(std::move(name)) {}

  void attach(BusNode& node) { nodes_.push_back(&node); }
  void tick(Time now);
  /// Injects a frame that no node has sent.
  void inject(const can::Frame& frame, Time time) { received_.push_back({time, frame}); }

  [[nodiscard]] can::SendResult send(const can::Frame& frame) noexcept override;
  [[nodiscard]] bool receive(can::StampedFrame& out) noexcept override;
  void flush() noexcept override { ++flushes; }
  [[nodiscard]] can::LinkState link() const noexcept override { return state; }
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override { return overflows; }
  [[nodiscard]] std::string_view name() const noexcept override { return name_; }

  std::vector<can::Frame> sent;  ///< everything the master sent
  can::SendResult result = can::SendResult::kQueued;
  can::LinkState state = can::LinkState::kActive;
  std::uint64_t overflows = 0;
  int flushes = 0;
  bool fd = false;                          ///< carries FD frames
  std::function<void(can::Frame&)> filter;  ///< applied to every received frame, if set

  /// Returns the text of the sent frames with this identifier.
  [[nodiscard]] std::vector<std::string> sent_with(std::uint32_t id) const;

 private:
  void collect();

  std::string name_;
  std::vector<BusNode*> nodes_;
  std::deque<can::StampedFrame> received_;
  Time now_{};
};

}  // namespace walkman::test
