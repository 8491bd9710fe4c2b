#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace walkman::nodes {

/// Types of a value (CiA 301, table 44).
enum class DataType : std::uint8_t {
  kInteger8,
  kInteger16,
  kInteger32,
  kUnsigned8,
  kUnsigned16,
  kUnsigned32,
  kReal32,
  kVisibleString,
  kDomain,
};

enum class Access : std::uint8_t { kReadOnly, kWriteOnly, kReadWrite, kConst };
enum class Mappable : bool { kNo, kYes };

/// Object codes of CiA 301, table 42.
enum class ObjectCode : std::uint8_t { kDomain = 2, kVariable = 7, kArray = 8, kRecord = 9 };

/// What one count of an object's value represents.
enum class Quantity : std::uint8_t {
  kPlain,                ///< words, counters, codes: no unit
  kPosition,             ///< µrad
  kVelocity,             ///< µrad/s
  kAcceleration,         ///< µrad/s²
  kTorquePerMille,       ///< per mille of the rated torque 6076h
  kCurrentPerMille,      ///< per mille of the rated current 6075h
  kMilliNewtonMetre,     ///< mN·m
  kMilliAmpere,          ///< mA
  kMilliVolt,            ///< mV
  kMilliSecond,          ///< ms
  kMicroSecond,          ///< µs
  kHundredMicroSeconds,  ///< 100 µs
  kDeciCelsius,          ///< 0.1 °C
  kCelsius,              ///< °C
  kStiffness,            ///< mN·m/rad
  kDamping,              ///< mN·m·s/rad
  kCoarseStiffness,      ///< 0.1 N·m/rad
  kCoarseDamping,        ///< 0.01 N·m·s/rad
  kTorqueSlope,          ///< per mille of the rated torque per second
  kMeasuredReal,         ///< CiA 404 value as REAL32, in the unit that 6131h names
  kMeasuredInteger,      ///< CiA 404 value as integer: 6131h with the decimal digits of 6132h
};

/// A value as stored in the table of objects: its bytes, the rest 0.
template <typename T>
[[nodiscard]] std::uint32_t to_raw(T value) noexcept {
  static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 4);
  std::uint32_t raw = 0;
  std::memcpy(&raw, &value, sizeof(T));
  return raw;
}

/// The value that `to_raw` converted to `raw`.
template <typename T>
[[nodiscard]] T from_raw(std::uint32_t raw) noexcept {
  static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 4);
  T value;
  std::memcpy(&value, &raw, sizeof(T));
  return value;
}

/// `value / unit`, rounded half away from zero and saturated to the range of T; 0 for a value that is not a
/// number.
template <typename T>
[[nodiscard]] T to_wire(double value, double unit) noexcept {
  constexpr auto kLowest = static_cast<double>(std::numeric_limits<T>::min());
  constexpr auto kHighest = static_cast<double>(std::numeric_limits<T>::max());
  const double counts = value * (1 / unit);  // folded for a constant unit
  if (!(counts > kLowest)) return counts <= kLowest ? std::numeric_limits<T>::min() : T{0};
  if (counts >= kHighest) return std::numeric_limits<T>::max();
  // Both the truncated value and the difference are exact.
  const auto whole = static_cast<std::int64_t>(counts);
  const double rest = counts - static_cast<double>(whole);
  return static_cast<T>(whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0));
}

inline constexpr double kMicro = 1e-6;  ///< urad, urad/s
inline constexpr double kMilli = 1e-3;  ///< mN·m, mV, per mille
inline constexpr double kDeci = 0.1;    ///< 0.1 degC, 0.1 N

template <typename T>
[[nodiscard]] constexpr DataType type_of() noexcept {
  if constexpr (std::is_same_v<T, std::int8_t>) return DataType::kInteger8;
  if constexpr (std::is_same_v<T, std::int16_t>) return DataType::kInteger16;
  if constexpr (std::is_same_v<T, std::int32_t>) return DataType::kInteger32;
  if constexpr (std::is_same_v<T, std::uint8_t>) return DataType::kUnsigned8;
  if constexpr (std::is_same_v<T, std::uint16_t>) return DataType::kUnsigned16;
  if constexpr (std::is_same_v<T, std::uint32_t>) return DataType::kUnsigned32;
  if constexpr (std::is_same_v<T, float>) return DataType::kReal32;
}

/// One sub-index in the table of objects. Dictionary, EDS, DBC and the tables of docs/protocol.md are made
/// from it. Created by `read_only`, `read_write`, `write_only`, `number`, `text`, `string` and `domain`
/// below, and refined by its own functions, each of which returns the row.
struct EntryRow {
  std::string_view name = {};
  DataType type = DataType::kUnsigned8;
  Access access = Access::kReadOnly;
  Mappable mappable = Mappable::kNo;
  std::uint32_t factory = 0;  ///< factory setting, as returned by `to_raw`
  bool own = false;           ///< each device overwrites `factory` with a setting of its own
  bool with_node_id = false;  ///< the factory setting is `factory` plus the node-ID
  std::int64_t lowest = 0;    ///< limits of an integer that may be written
  std::int64_t highest = 0;
  std::uint64_t allowed =
      0;  ///< one bit for each of the numbers 0..63 that may be written; 0: all within the limits
  std::size_t longest = 0;  ///< maximum length of a string in bytes
  Quantity quantity = Quantity::kPlain;
  std::string_view symbol = {};  ///< word for signal names, at most 15 characters; empty: made from the names
  std::string_view meaning = {};  ///< one-line description; empty if the name suffices

  /// Allows PDOs to carry it.
  [[nodiscard]] EntryRow pdo() const {
    return with([](EntryRow& row) { row.mappable = Mappable::kYes; });
  }
  /// Sets what one count represents.
  [[nodiscard]] EntryRow in(Quantity value) const {
    return with([&](EntryRow& row) { row.quantity = value; });
  }
  /// Sets the word for signal names.
  [[nodiscard]] EntryRow called(std::string_view word) const {
    return with([&](EntryRow& row) { row.symbol = word; });
  }
  /// Sets the one-line description.
  [[nodiscard]] EntryRow means(std::string_view line) const {
    return with([&](EntryRow& row) { row.meaning = line; });
  }
  /// Refuses values outside with 0609 0032 or 0609 0031.
  [[nodiscard]] EntryRow within(std::int64_t low, std::int64_t high) const {
    return with([&](EntryRow& row) { row.lowest = low, row.highest = high; });
  }
  /// Refuses other values between the least and the greatest with 0609 0030; `values` must be in 0..63.
  [[nodiscard]] EntryRow one_of(std::initializer_list<int> values) const;
  /// Gives each device its own factory setting.
  [[nodiscard]] EntryRow of_the_device() const {
    return with([](EntryRow& row) { row.own = true; });
  }
  /// Adds the node-ID to the factory setting.
  [[nodiscard]] EntryRow plus_node_id() const {
    return with([](EntryRow& row) { row.with_node_id = true; });
  }

 private:
  template <typename Change>
  [[nodiscard]] EntryRow with(const Change& change) const {
    EntryRow row = *this;
    change(row);
    return row;
  }
};

/// A number with its factory setting. An integer has the limits of its type until `within` or `one_of` sets
/// others.
template <typename T>
[[nodiscard]] EntryRow number(std::string_view name, Access access, T factory) {
  EntryRow row{name, type_of<T>(), access};
  row.factory = to_raw(factory);
  if constexpr (std::is_integral_v<T>) {
    row.lowest = +std::numeric_limits<T>::min();
    row.highest = +std::numeric_limits<T>::max();
  }
  return row;
}
/// `number` that a client may read.
template <typename T>
[[nodiscard]] EntryRow read_only(std::string_view name, T factory = {}) {
  return number<T>(name, Access::kReadOnly, factory);
}
/// `number` that a client may read and write.
template <typename T>
[[nodiscard]] EntryRow read_write(std::string_view name, T factory = {}) {
  return number<T>(name, Access::kReadWrite, factory);
}
/// A command: `number` that a client may write.
template <typename T>
[[nodiscard]] EntryRow write_only(std::string_view name) {
  return number<T>(name, Access::kWriteOnly, T{});
}
/// A constant visible string.
[[nodiscard]] EntryRow text(std::string_view name);
/// A visible string that may be written, empty at first, of at most `longest` bytes.
[[nodiscard]] EntryRow string(std::string_view name, std::size_t longest);
/// A read-only domain.
[[nodiscard]] EntryRow domain(std::string_view name);

/// One object, or several that differ only by a number.
struct ObjectRow {
  std::uint16_t index = 0;  ///< of the first
  ObjectCode code = ObjectCode::kVariable;
  std::string_view name = {};  ///< "{}" is replaced by the number of the object, 1 for the first
  EntryRow zero = {};          ///< sub-index 0: the value of a variable, else the number of entries
  /// Sub-index 1, 2, ...; one without a name does not exist.
  std::vector<EntryRow> entries = {};
  /// If it has a name, the row of every sub-index from 1 on, with "{}" replaced by the sub-index.
  EntryRow each = {};
  std::uint16_t objects = 1;      ///< number of objects
  std::uint8_t each_count = 0;    ///< number of sub-indices of `each`, if the table defines it
  std::string_view meaning = {};  ///< one-line description of the whole object

  [[nodiscard]] bool simple() const noexcept {
    return code == ObjectCode::kVariable || code == ObjectCode::kDomain;
  }
  [[nodiscard]] ObjectRow means(std::string_view line) const {
    ObjectRow row = *this;
    row.meaning = line;
    return row;
  }
  /// The row of a sub-index; null if there is none.
  [[nodiscard]] const EntryRow* find(std::uint8_t sub) const noexcept;
};

/// A VAR, or a DOMAIN if `value` is one; it has the name of `value`.
[[nodiscard]] ObjectRow variable(std::uint16_t index, const EntryRow& value);
/// An ARRAY of `entries`, sub-index 1 first; sub-index 0 is their number.
[[nodiscard]] ObjectRow array(std::uint16_t index, std::string_view name, std::vector<EntryRow> entries);
/// A RECORD of `entries`, sub-indices as in `array`.
[[nodiscard]] ObjectRow record(std::uint16_t index, std::string_view name, std::vector<EntryRow> entries);
/// An array of `count` entries that are all alike; 0 if each device has its own number of them.
[[nodiscard]] ObjectRow array_of(std::uint16_t index, std::string_view name, const EntryRow& each,
                                 std::uint8_t count);

using ObjectTable = std::span<const ObjectRow>;

}  // namespace walkman::nodes
