#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// Bits of the error register 1001h.
namespace error_register {
inline constexpr std::uint8_t kGeneric = 0x01;
inline constexpr std::uint8_t kCurrent = 0x02;
inline constexpr std::uint8_t kVoltage = 0x04;
inline constexpr std::uint8_t kTemperature = 0x08;
inline constexpr std::uint8_t kCommunication = 0x10;
inline constexpr std::uint8_t kProfile = 0x20;
inline constexpr std::uint8_t kManufacturer = 0x80;
}  // namespace error_register

/// EMCY codes of the communication layer (CiA 301, table 26).
namespace communication_error {

inline constexpr std::uint16_t kOverrun = 0x8110;       ///< objects lost: the transmit queue was full
inline constexpr std::uint16_t kErrorPassive = 0x8120;  ///< the CAN controller is error-passive
inline constexpr std::uint16_t kMasterLost = 0x8130;    ///< heartbeat or life guarding
inline constexpr std::uint16_t kBusOffOver = 0x8140;    ///< recovered from bus-off
inline constexpr std::uint16_t kPdoTooShort = 0x8210;   ///< RPDO not processed due to its length
inline constexpr std::uint16_t kPdoTooLong = 0x8220;    ///< RPDO longer than mapped
inline constexpr std::uint16_t kSyncLength = 0x8240;    ///< unexpected SYNC data length
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;   ///< RPDO deadline

}  // namespace communication_error

/// Emergency producer (CiA 301, 7.2.7): present errors, error register 1001h, history 1003h, EMCY object with
/// its COB-ID 1014h and inhibit time 1015h. An error is reported once when it appears; one message 0000h is
/// sent when the last one ends.
class EmergencyProducer {
 public:
  static constexpr std::size_t kHistory = 8;

  EmergencyProducer(ObjectDictionary& dictionary, Outbox& outbox);
  EmergencyProducer(const EmergencyProducer&) = delete;
  EmergencyProducer& operator=(const EmergencyProducer&) = delete;

  /// Does nothing if `code` is already present. `detail` goes into the manufacturer's five bytes, its first
  /// two bytes into the history.
  void raise(std::uint16_t code, std::uint8_t register_bits, std::span<const std::uint8_t> detail,
             Time now) noexcept;
  void raise(std::uint16_t code, std::uint8_t register_bits, Time now) noexcept {
    raise(code, register_bits, {}, now);
  }
  /// Ends error `code`, and sends 0000h if it was the last. Does nothing if it is not present.
  void clear(std::uint16_t code, Time now) noexcept;
  [[nodiscard]] bool active(std::uint16_t code) const noexcept;

  /// Sets whether EMCY may be sent; while it may not, messages are dropped.
  void enable(bool enabled) noexcept;
  /// Reset node: clears errors, history and waiting messages.
  void reset() noexcept;
  /// Reset communication: as `reset`, but keeps errors of the device itself, which lack the register's
  /// communication bit; `announce` reports them again.
  void reset_communication() noexcept;
  [[nodiscard]] bool some_outlasted_reset() const noexcept { return outlasting_ > 0; }
  void announce(Time now) noexcept;

  /// Sends messages that have waited for the inhibit time 1015h (in 100 us) since the last message.
  void advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept;

 private:
  struct Present {
    std::uint16_t code = 0;
    std::uint8_t bits = 0;
  };
  using Payload = std::array<std::uint8_t, 8>;

  void forget_reports() noexcept;
  void add_to_history(std::uint32_t value) noexcept;
  void update_register() noexcept;
  void send(std::uint16_t code, std::span<const std::uint8_t> detail, Time now) noexcept;

  Outbox& outbox_;
  Object<std::uint8_t> error_register_;
  Object<std::uint8_t> history_count_;
  std::array<Object<std::uint32_t>, kHistory> history_;
  Object<std::uint32_t> cob_id_;
  Object<std::uint16_t> inhibit_;

  std::array<Present, 16> present_{};
  std::size_t present_count_ = 0;
  std::size_t outlasting_ =
      0;  // number of errors, first in `present_`, that outlasted a reset and are not yet reported
  std::array<Payload, 8> waiting_{};
  std::size_t waiting_count_ = 0;
  Time allowed_from_{};
  bool enabled_ = false;
};

}  // namespace walkman::nodes
