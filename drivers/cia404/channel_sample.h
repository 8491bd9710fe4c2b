#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/canopen/pdo_settings.h"
#include "drivers/time.h"

namespace walkman::cia404 {

/// The samples of a measuring device (CiA 404): process values 7130h:1..n as i16, a sample counter (2050h:1)
/// and a status (6150h:1), spread over TPDOs according to a mapping. Combines the frames that left the device
/// with the same SYNC; never mixes those of different SYNCs. Does not allocate after construction.
class ChannelSample {
 public:
  static constexpr std::size_t kMaxChannels = 10;

  /// `cycle`: the SYNC period. Throws std::runtime_error (one sentence) if one of the objects is in no TPDO
  /// of transmission type 1 to 240, or has the wrong size.
  ChannelSample(const canopen::DevicePdos& pdos, std::size_t channels, Time cycle);

  /// Takes TPDO `number`. Returns true if it completes a new sample: frames of one SYNC follow each other
  /// within the cycle, and the counter must have advanced.
  [[nodiscard]] bool take(int number, const can::StampedFrame& frame) noexcept;
  /// Forgets everything it has taken.
  void reset() noexcept;

  /// Process value of the newest sample as on the wire; `channel` 0..n-1 is 7130h:1..n, in the unit of 6131h
  /// with the decimal digits of 6132h.
  [[nodiscard]] std::int16_t raw(std::size_t channel) const noexcept { return complete_.raw[channel]; }
  /// Counter of the newest sample, 2050h:1.
  [[nodiscard]] std::uint16_t counter() const noexcept { return complete_.counter; }
  /// Status of the newest sample, 6150h:1.
  [[nodiscard]] std::uint8_t status() const noexcept { return complete_.status; }
  /// Stamp of the oldest frame of the newest sample; `Time::min()` before the first.
  [[nodiscard]] Time at() const noexcept { return at_; }
  /// Whether a value is at the minimum or maximum of its 16 bits: no measurement.
  [[nodiscard]] bool out_of_range(std::size_t channel) const noexcept;

 private:
  struct Values {
    std::array<std::int16_t, kMaxChannels> raw{};
    std::uint16_t counter = 0;
    std::uint8_t status = 0;
  };
  enum class Kind : std::uint8_t { kChannel, kCounter, kStatus };
  struct Field {
    Kind kind{};
    std::uint8_t offset = 0;
    std::uint8_t channel = 0;
  };
  void take_mapping(int number, const canopen::PdoSettings& settings, std::size_t channels);
  [[nodiscard]] bool belongs(int number, Time at) noexcept;
  void decode(int number, const can::Frame& frame) noexcept;

  Time cycle_;
  std::array<std::vector<Field>, 4> fields_;
  unsigned all_ = 0;    // TPDOs that make up a sample, bit n - 1
  int first_ = 0;       // the one that wins arbitration
  unsigned taken_ = 0;  // those received of the present sample
  Time taken_at_{};
  Values coming_, complete_;
  Time at_ = Time::min();
};

}  // namespace walkman::cia404
