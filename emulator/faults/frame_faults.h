#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "emulator/bus/can_bus.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::faults {

/// Effect of one fault on frames. Only the constructors allocate or throw.
class FrameFault {
 public:
  /// Concerns the frames of `node` (0: of the whole bus) in a direction.
  FrameFault(std::uint8_t node, Direction direction) : node_(node), direction_(direction) {}
  virtual ~FrameFault() = default;

  /// Called when an attempt to send a frame begins.
  [[nodiscard]] virtual bus::FrameFate begins(const can::Frame& /*frame*/, Time /*now*/) noexcept {
    return bus::FrameFate::deliver();
  }
  /// Called when a frame has been transmitted; it may be altered. Returns false if nobody is to receive it.
  [[nodiscard]] virtual bool ends(can::Frame& /*frame*/, Time /*now*/) noexcept { return true; }
  /// Called when the fault begins, possibly not for the first time, and when it ends.
  virtual void start() noexcept {}
  virtual void finish() noexcept {}
  /// Called when a physics step has begun.
  virtual void step(Time /*now*/) noexcept {}

  /// Whether the fault concerns a frame.
  [[nodiscard]] bool concerns(const can::Frame& frame) const noexcept;
  /// Number of frames affected.
  [[nodiscard]] std::uint64_t touched() const noexcept { return touched_; }

 protected:
  void touch() noexcept { ++touched_; }

 private:
  std::uint8_t node_;
  Direction direction_;
  std::uint64_t touched_ = 0;
};

/// The frame faults of one bus: the only user of the bus's hooks. `bus` must outlive it.
class BusFaults {
 public:
  explicit BusFaults(bus::CanBus& bus);
  BusFaults(const BusFaults&) = delete;
  BusFaults& operator=(const BusFaults&) = delete;

  /// `node`, `participant`: those of a device; 0 and null: the whole bus.
  [[nodiscard]] std::unique_ptr<FrameFault> make(const Injection& injection, std::uint8_t node,
                                                 const bus::Participant* participant);
  void add(FrameFault& fault) { active_.push_back(&fault); }
  void remove(const FrameFault& fault) { std::erase(active_, &fault); }
  void step(Time now) noexcept;
  /// Calls `reached` once, at the end of the nth frame with an identifier from now on, before any fault of
  /// frames is applied to it.
  void await(std::uint32_t id, std::uint64_t nth, std::function<void(Time)> reached) {
    awaited_.push_back({id, nth, std::move(reached)});
  }

 private:
  struct Awaited {
    std::uint32_t id = 0;
    std::uint64_t left = 0;
    std::function<void(Time)> reached;
  };
  void count(const can::Frame& frame, Time now);

  bus::CanBus& bus_;
  std::vector<Awaited> awaited_;
  std::vector<bus::ComputerPort*> idle_ports_;  // for additional frames, at present of no fault
  std::vector<FrameFault*> active_;
};

}  // namespace walkman::faults
