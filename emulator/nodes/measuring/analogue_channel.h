#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::nodes {

/// Bits of a measuring status 6150h.
namespace measuring_status {
inline constexpr std::uint8_t kInvalid = 1;
inline constexpr std::uint8_t kPositiveOverload = 2;
inline constexpr std::uint8_t kNegativeOverload = 4;
}  // namespace measuring_status

/// Hardware of one channel of an analogue input device.
struct ChannelDescription {
  double range = 0;                    ///< readings beyond +-range are an overload, SI unit
  double resolution = 0;               ///< step of a reading, SI unit; 0: none
  double wire_unit = 1;                ///< unit of the integer process values 7130h and 9130h, SI unit
  std::uint16_t sensor_type = 0;       ///< 6110h; manufacturer-specific from 10000 on
  std::uint32_t unit_code = 0;         ///< 6131h (CiA 303-2: prefix, numerator, denominator)
  std::optional<std::uint8_t> digits;  ///< 6132h, if the wire unit is a power of ten of the SI unit
  /// The channel has a filter and may be scaled, zeroed and tared.
  bool adjustable = true;
};

/// One channel of an analogue input (CiA 404-2), whose number is the sub-index of every object below.
///
/// A reading passes through range, resolution and filter 61A0h (0 none; 1 a first-order low-pass with the
/// time constant 61A1h in ms; 2 two of them in series) and is then the field value 6100h (real32; 7100h i16).
/// The process value is
///     6126h * field value + 6127h + 6124h - 6138h,
/// with scaling factor, scaling offset, input offset and tare: 6130h real32, 7130h i16 and 9130h i32. This is
/// the net value, which 6140h repeats. Writing "zero" to 6125h sets the input offset, and "tara" to 6139h the
/// tare, so that the present process value becomes 0.
///
/// An event occurs when the process value has changed by more than 6133h (0: none) since the last event, or
/// crosses the limit 6134h or 6135h in either direction.
class AnalogueChannel {
 public:
  /// Uses its objects, which `add_objects` must have added.
  AnalogueChannel(ObjectDictionary& dictionary, std::uint8_t channel, const ChannelDescription& description,
                  std::uint32_t sample_period_us);
  AnalogueChannel(const AnalogueChannel&) = delete;
  AnalogueChannel& operator=(const AnalogueChannel&) = delete;

  /// Adds the objects of `channels` channels: the first `digits` of them have a number of digits, the first
  /// `adjustable` the objects of adjustment.
  static void add_objects(ObjectDictionary& dictionary, std::uint8_t channels, std::uint8_t digits,
                          std::uint8_t adjustable);

  /// Takes a reading and returns the measuring status. A reading that is not finite, and any while the
  /// channel is off (6112h), is invalid; the last values stay.
  [[nodiscard]] std::uint8_t sample(double reading) noexcept;
  /// Whether the last sample was an event; call once per sample.
  [[nodiscard]] bool event() noexcept;

  [[nodiscard]] bool on() const noexcept { return operating_mode_.get() != 0; }
  void set_status(std::uint8_t status) noexcept { status_.set(status); }
  /// Makes the channel invalid until the next sample, from which the filter starts.
  void reset() noexcept;

  /// The entries of the process value in all its formats, null if there is none.
  [[nodiscard]] std::array<const Entry*, 4> process_value_entries() const noexcept;

 private:
  void bind_measurement(ObjectDictionary& dictionary, std::uint32_t sample_period_us);
  void bind_events(ObjectDictionary& dictionary);
  void bind_adjustment(ObjectDictionary& dictionary);
  void filter(double resolved) noexcept;
  void publish() noexcept;

  std::uint8_t channel_;
  ChannelDescription description_;
  double sample_period_;  // s
  Object<std::uint8_t> operating_mode_, status_;
  Object<float> process_value_;
  Object<std::int16_t> process_value_i16_;
  Object<std::int32_t> process_value_i32_;
  Object<float> event_delta_, lower_limit_, upper_limit_;
  // Only for an adjustable channel.
  Object<float> field_value_, input_offset_, factor_, scaling_offset_, tare_, net_value_;
  Object<std::int16_t> field_value_i16_;
  Object<std::uint8_t> filter_type_;
  Object<std::uint16_t> filter_constant_;

  double first_stage_ = 0, filtered_ = 0;
  bool has_reading_ = false;  // the filter has a value to start from
  bool fresh_ = false;        // a sample has come since the last call of `event`
  float last_event_ = 0;      // process value
  int zone_ = 0;              // -1 below the lower limit, 1 above the upper
};

}  // namespace walkman::nodes
