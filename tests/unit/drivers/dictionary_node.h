#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/drivers/fake_node.h"

namespace walkman::test {

/// A minimal device with an object dictionary: NMT, boot-up, heartbeat, expedited SDO, PDOs according to
/// their communication and mapping records with the rules for changes at run time, the power states of CiA
/// 402. It is written from the standards and shares no code with what it tests.
class DictionaryNode : public BusNode {
 public:
  /// `fd`: PDOs of up to 64 bytes, all sent as FD frames.
  DictionaryNode(unsigned id, bool fd) : id_(id), fd_(fd) {}

  /// Defines the objects that every device has and those of a drive, a six-channel sensor or an inertial
  /// unit; all PDOs are off.
  void become_drive(std::uint32_t rated_torque_mnm, std::uint32_t spring_mnm);
  void become_sensor(int channels);

  void define(unsigned index, unsigned sub, unsigned bytes, std::uint64_t value);
  [[nodiscard]] std::uint64_t value(unsigned index, unsigned sub = 0) const {
    return objects_.at({index, sub}).value;
  }
  void set(unsigned index, unsigned sub, std::uint64_t value) { objects_.at({index, sub}).value = value; }

  void hear(const can::Frame& sent, Time now) override;
  void tick(Time now) override;
  [[nodiscard]] std::vector<can::StampedFrame> take() override;

  /// Switches the device off and on: boot-up and pre-operational, all configuration lost.
  void power_cycle(Time now);
  void fault(std::uint16_t code);
  /// True if the fault persists and cannot be reset.
  bool fault_persists = false;
  bool mute = false;            ///< sends nothing
  bool moves = true;            ///< 6064h follows 607Ah once enabled
  bool wrong_readback = false;  ///< reports a wrong 1A00h:1
  std::vector<std::string> refusals;
  int resets = 0;        ///< NMT reset communication commands received
  int fault_resets = 0;  ///< rising edges of bit 7 that left the fault state

 private:
  struct Object {
    unsigned bytes = 0;
    std::uint64_t value = 0;
    std::uint64_t initial = 0;
  };
  void define_common(std::uint32_t device_type);
  void define_pdos();
  void send(const can::Frame& frame) {
    if (!mute) sent_.push_back({now_, frame});
  }
  void boot_up();
  void nmt(unsigned command);
  void sdo(const can::Frame& request);
  [[nodiscard]] std::uint32_t judge_write(unsigned index, unsigned sub, unsigned bytes,
                                          std::uint64_t value) const;
  [[nodiscard]] can::Frame tpdo(unsigned n);
  /// True if the last object of the mapping is 2052h.
  [[nodiscard]] bool protects(unsigned mapping) const;
  void take_rpdo(unsigned n, const can::Frame& frame);
  void sync();
  void run_state_machine();

  unsigned id_;
  bool fd_;
  bool drive_ = false;
  std::map<std::pair<unsigned, unsigned>, Object> objects_;
  unsigned nmt_state_ = 0x7F;
  Time now_{}, heartbeat_due_ = Time::max(), event_due_{};
  std::array<unsigned, 4> syncs_{}, counts_{};
  std::array<unsigned, 4> rpdo_counts_{256, 256, 256, 256};  // none yet
  std::array<bool, 4> waiting_{};
  std::array<can::Frame, 4> rpdos_{};
  std::uint16_t last_controlword_ = 0;
  std::vector<can::StampedFrame> sent_;
};

}  // namespace walkman::test
