#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/canopen/sdo.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

using canopen::ObjectAddress;
using canopen::SdoAbort;

/// Empty if an access is granted, else the abort code sent to the client.
using Refusal = std::optional<SdoAbort>;

/// One sub-index of an object: type, access rights, value. Numbers are kept as the bytes they have on the
/// wire.
///
/// A value may be kept across resets (objects 1010h and 1011h); the copy is kept here, as in a real device's
/// non-volatile memory, and lives as long as the node.
struct Entry {
  explicit Entry(std::uint32_t& value) : raw(value) {}

  ObjectAddress address;
  DataType type{};
  Access access{};
  Mappable mappable = Mappable::kNo;
  std::uint32_t& raw;       ///< little-endian value of a number, upper bytes zero
  std::int64_t lowest = 0;  ///< limits of an integer that may be written
  std::int64_t highest = 0;
  std::uint64_t allowed = 0;  ///< as `EntryRow::allowed`
  /// Called before a new value is stored; may refuse it or act on it.
  std::function<Refusal(std::uint32_t raw)> write_hook;
  /// Called before a read; may refuse it.
  std::function<Refusal()> read_hook;

  const ObjectRow* object = nullptr;  ///< its object in the table of objects
  const EntryRow* row = nullptr;
  std::uint32_t default_raw = 0;  ///< factory setting
  bool plus_node_id = false;      ///< the factory setting contains the node-ID
  std::string text;               ///< value of a string or domain
  std::string default_text;
  std::size_t longest = 0;  ///< maximum length of a string in bytes

  bool stored = false;  ///< the values below are used after a reset instead of the factory setting
  std::uint32_t stored_raw = 0;
  std::string stored_text;

  /// Size of the value in bytes.
  [[nodiscard]] std::size_t size() const noexcept;
  /// Size in bytes of the longest value that may be written.
  [[nodiscard]] std::size_t capacity() const noexcept { return number() ? size() : longest; }
  /// The value as it is on the wire; valid until the entry is written.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept;
  [[nodiscard]] bool number() const noexcept {
    return type != DataType::kVisibleString && type != DataType::kDomain;
  }
  [[nodiscard]] bool readable() const noexcept { return access != Access::kWriteOnly; }
  [[nodiscard]] bool writable() const noexcept {
    return access == Access::kReadWrite || access == Access::kWriteOnly;
  }
};

/// The node's own typed access to an entry. Setting a value here calls no hook and checks no limit.
template <typename T>
class Object {
 public:
  Object() = default;
  explicit Object(Entry& entry) : entry_(&entry), value_(&entry.raw) {}

  [[nodiscard]] T get() const noexcept { return from_raw<T>(*value_); }
  void set(T value) noexcept { *value_ = to_raw(value); }
  [[nodiscard]] const Entry& entry() const noexcept { return *entry_; }

  /// Values outside [lowest, highest] are refused with 0609 0032 or 0609 0031.
  Object& limits(std::int64_t lowest, std::int64_t highest) {
    entry_->lowest = lowest;
    entry_->highest = highest;
    return *this;
  }
  /// Sets the value as this device's factory setting.
  Object& factory(T value) {
    *value_ = entry_->default_raw = to_raw(value);
    return *this;
  }
  Object& on_write(std::function<Refusal(T)> hook) {
    entry_->write_hook = [hook = std::move(hook)](std::uint32_t raw) { return hook(from_raw<T>(raw)); };
    return *this;
  }
  Object& on_read(std::function<Refusal()> hook) {
    entry_->read_hook = std::move(hook);
    return *this;
  }

 private:
  Entry* entry_ = nullptr;
  std::uint32_t* value_ = nullptr;
};

/// A node's object dictionary (CiA 301, 7.4), built from rows of the table of objects. Entries do not move,
/// and no access allocates.
class ObjectDictionary {
 public:
  /// Longest string that may be written, and longest domain, in bytes.
  static constexpr std::size_t kLongestString = 1024;
  static constexpr std::size_t kLongestDomain = 131072;

  /// `node_id` is added to the factory settings that contain it.
  explicit ObjectDictionary(std::uint8_t node_id = 0) : node_id_(node_id) {}

  /// Adds an object with all its sub-indices. Throws std::runtime_error if it already exists, or a string may
  /// be longer than `kLongestString`.
  void add(const ObjectRow& row) { add(row, row.each_count); }
  /// The same for an object of `count` entries that are all alike.
  void add(const ObjectRow& row, std::uint8_t count);
  void add(ObjectTable table);
  /// Adds the next entry to an object whose entries are all alike.
  void extend(std::uint16_t index);

  /// Returns access to an entry. Throws std::runtime_error if there is none or it has another type.
  template <typename T>
  [[nodiscard]] Object<T> object(std::uint16_t index, std::uint8_t sub = 0) {
    return Object<T>(typed({index, sub}, type_of<T>()));
  }
  /// Sets the text of a constant visible string. Throws as `object` does.
  void set_text(std::uint16_t index, std::string text);
  /// Sets the content of a domain; not in cyclic operation. While it is empty, reading it is refused with
  /// 0800 0024. Throws std::runtime_error if there is no such domain or `content` is longer than
  /// `kLongestDomain`.
  void set_domain(std::uint16_t index, std::string content);

  /// Returns null if there is none.
  [[nodiscard]] Entry* find(std::uint16_t index, std::uint8_t sub) noexcept;
  [[nodiscard]] const Entry* find(std::uint16_t index, std::uint8_t sub) const noexcept;
  /// Abort code for an address that `find` does not know: 0602 0000 or 0609 0011.
  [[nodiscard]] SdoAbort missing(std::uint16_t index) const noexcept;

  /// Every entry, by index, then sub-index.
  [[nodiscard]] std::span<const std::unique_ptr<Entry>> entries() const noexcept { return entries_; }

  /// Stores `bytes` in `entry` after checking access rights, length, limits and the hook.
  [[nodiscard]] Refusal write(Entry& entry, std::span<const std::uint8_t> bytes) noexcept;
  /// Checks access rights and calls the hook; the value is then in `entry`.
  [[nodiscard]] Refusal read(const Entry& entry) const noexcept;

  /// Sets every writable entry with an index in [first, last] to its value after a reset: the stored one,
  /// else its factory setting. Calls no hooks.
  void power_on(std::uint16_t first, std::uint16_t last) noexcept;
  /// Stores the parameters with an index in [first, last]: everything that may be read and written, except
  /// momentary commands (what an RPDO may carry, 1003h, 1010h, 1011h).
  void store(std::uint16_t first, std::uint16_t last) noexcept;
  /// Discards the stored values; the values in use stay until the next reset.
  void forget(std::uint16_t first, std::uint16_t last) noexcept;
  /// Adapts the factory settings that contain the node-ID, which has changed by `difference`.
  void shift_node_id(int difference) noexcept;

 private:
  void insert(ObjectAddress address, const ObjectRow& object, const EntryRow& row);
  Entry& typed(ObjectAddress address, DataType type);

  std::uint8_t node_id_;
  std::deque<ObjectRow> rows_;                   // of the table, to which entries point
  std::vector<std::unique_ptr<Entry>> entries_;  // by index, then sub-index
  // Values of the entries, kept next to each other because a device uses them a thousand times a second, but
  // the rest of an entry only occasionally.
  std::deque<std::uint32_t> values_;
};

}  // namespace walkman::nodes
