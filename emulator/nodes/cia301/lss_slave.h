#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/can/frame.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// Vendor-ID, product code, revision and serial number: the values of 1018h:1-4, by which LSS identifies a
/// device.
using LssAddress = std::array<std::uint32_t, 4>;

/// LSS slave (CiA 305): the services that find a device by its LSS address and give it node-ID and bit
/// timing.
///
/// A node-ID set here becomes pending; it is in use after the next reset communication, and after reset node
/// only if it was stored. Node-ID FFh makes the device unconfigured: it then takes part in nothing but LSS,
/// and boots when a node-ID has been set and LSS is switched back to the waiting state. A bit timing is
/// accepted and stored, but every device on an emulated bus has the bus's bit rate, whatever is activated.
class LssSlave {
 public:
  static constexpr std::uint32_t kRequestId = 0x7E5;
  static constexpr std::uint32_t kResponseId = 0x7E4;
  static constexpr std::uint8_t kUnconfigured = 0xFF;

  LssSlave(Outbox& outbox, const LssAddress& address, std::uint8_t node_id)
      : outbox_(outbox), address_(address), pending_(node_id), stored_(node_id) {}

  /// Takes a frame on `kRequestId`; `active` is the node-ID in use. Returns true if an unconfigured device
  /// has received its node-ID and must boot now.
  [[nodiscard]] bool receive(const can::Frame& frame, std::uint8_t active) noexcept;

  /// The node-ID for the next reset communication.
  [[nodiscard]] std::uint8_t pending() const noexcept { return pending_; }
  /// Power-on and reset node: makes the stored node-ID the pending one and the LSS state waiting.
  void power_on() noexcept;
  /// Makes the LSS state waiting; pending values stay.
  void reset_communication() noexcept;

 private:
  using Request = std::span<const std::uint8_t, 8>;

  [[nodiscard]] bool switch_global(Request request, std::uint8_t active) noexcept;
  void switch_selective(unsigned part, std::uint32_t value) noexcept;
  void identify_remote(unsigned part, std::uint32_t value) noexcept;
  void fastscan(Request request, std::uint8_t active) noexcept;
  void configure(Request request) noexcept;
  void inquire(std::uint8_t command, std::uint8_t active) noexcept;
  void answer(std::uint8_t command) noexcept;
  void answer(std::uint8_t command, std::uint32_t value) noexcept;

  Outbox& outbox_;
  LssAddress address_;
  std::uint8_t pending_, stored_;
  std::uint8_t bit_timing_ = 0, stored_bit_timing_ = 0;  // table 0: 1 Mbit/s
  bool configuration_ = false;                           // LSS state configuration; else waiting
  unsigned selected_ = 0;                                // parts of a switch selective that matched so far
  unsigned identified_ = 0;                              // conditions of an identify that held so far
  std::uint8_t scanned_ = 0;                             // part that the fastscan asks for next
};

}  // namespace walkman::nodes
