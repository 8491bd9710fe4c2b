#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::nodes {

/// Factory settings of one PDO.
struct PdoDefaults {
  bool enabled = false;
  std::uint8_t type = 1;                 ///< transmission type
  std::uint16_t event_time_ms = 0;       ///< sub-index 5
  std::vector<std::uint32_t> mapping{};  ///< index << 16 | sub << 8 | bits
};

/// Value of a mapping entry.
[[nodiscard]] constexpr std::uint32_t mapped(std::uint16_t index, std::uint8_t sub,
                                             std::uint8_t bits) noexcept {
  return std::uint32_t{index} << 16U | std::uint32_t{sub} << 8U | bits;
}

/// Communication record (14xxh, 18xxh) and mapping record (16xxh, 1Axxh) of one PDO, with the checks of a
/// change at run time (CiA 301, 7.5.2.36): invalidate, sub 0 := 0, entries, sub 0 := n, validate. A write out
/// of order is refused with 0800 0022. A PDO has up to 8 objects and 8 bytes, with CAN FD up to 64 of each.
class PdoRecord {
 public:
  enum class Direction { kReceive, kTransmit };
  static constexpr std::size_t kMaxObjects = 64;
  static constexpr std::size_t kMaxBytes = 64;
  static constexpr std::size_t kClassicalObjects = 8;
  static constexpr std::size_t kClassicalBytes = 8;

  struct MappedEntry {
    Entry* entry = nullptr;  ///< null: dummy bytes
    std::uint8_t bytes = 0;
  };

  /// `number`: 1..4. Objects of the default mapping must already be in the dictionary; throws
  /// std::runtime_error if one cannot be mapped.
  PdoRecord(ObjectDictionary& dictionary, Direction direction, int number, std::uint32_t cob_id,
            const PdoDefaults& defaults);
  PdoRecord(const PdoRecord&) = delete;
  PdoRecord& operator=(const PdoRecord&) = delete;

  /// Sets the hook called after a communication parameter has changed.
  void on_change(std::function<void()> hook) { changed_ = std::move(hook); }

  /// Called by `report` with each mapped object, for logs; not with the protection, which has no value. Must
  /// not throw.
  using Observer = std::function<void(std::uint32_t cob_id, const Entry& entry)>;
  void observe(Observer observer) { observer_ = std::move(observer); }
  void report() const noexcept {
    if (!observer_) return;
    for (const MappedEntry& object : objects())
      if (object.entry != nullptr && !(protects_ && &object == &objects().back()))
        observer_(identifier_, *object.entry);
  }

  /// Makes it a PDO of up to 64 bytes in CAN FD frames. At most once; allocates.
  void use_fd();

  /// Applies the values now in the dictionary, after defaults were restored.
  void reload() noexcept;

  [[nodiscard]] bool valid() const noexcept { return valid_; }
  [[nodiscard]] bool remote_allowed() const noexcept { return remote_allowed_; }
  [[nodiscard]] std::uint32_t identifier() const noexcept { return identifier_; }
  [[nodiscard]] std::uint8_t type() const noexcept { return type_value_; }
  [[nodiscard]] bool synchronous() const noexcept { return type_value_ <= 240; }
  [[nodiscard]] bool event_driven() const noexcept { return type_value_ >= 254; }
  /// Counter value that the first SYNC must have (TPDO, sub-index 6); 0: any.
  [[nodiscard]] std::uint8_t sync_start() const noexcept { return sync_start_value_; }
  [[nodiscard]] bool fd() const noexcept { return fd_; }
  [[nodiscard]] Time inhibit_time() const noexcept { return inhibit_time_; }
  [[nodiscard]] Time event_time() const noexcept { return event_time_; }
  [[nodiscard]] std::span<const MappedEntry> objects() const noexcept { return {objects_.data(), count_}; }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] bool maps(const Entry& entry) const noexcept;
  /// Whether its last object is the protection, 2052h.
  [[nodiscard]] bool protects() const noexcept { return protects_; }

 private:
  void bind_communication_record(std::uint32_t cob_id, const PdoDefaults& defaults, int number);
  void bind_mapping_record(const PdoDefaults& defaults, int number);
  void bind_mapping_entry(std::size_t i, std::uint32_t value);
  [[nodiscard]] bool type_offered(std::uint8_t type) const noexcept;
  [[nodiscard]] Refusal resolve(std::uint32_t entry, MappedEntry& object) const noexcept;
  [[nodiscard]] Refusal resolve_all(std::size_t count) noexcept;
  void take_cob_id(std::uint32_t value) noexcept;
  void changed() noexcept {
    if (changed_) changed_();
  }

  // Members needed for every frame and every SYNC come first: forty nodes are a lot of memory.
  bool valid_ = false;
  bool remote_allowed_ = false;
  bool protects_ = false;
  bool fd_ = false;
  std::uint8_t type_value_ = 0;
  std::uint8_t sync_start_value_ = 0;
  std::uint32_t identifier_ = 0;
  std::size_t count_ = 0;
  std::size_t bytes_ = 0;
  Time inhibit_time_{};
  Time event_time_{};
  Observer observer_;
  std::array<MappedEntry, kMaxObjects> objects_{};

  ObjectDictionary& dictionary_;
  Direction direction_;
  std::uint16_t mapping_index_;
  std::function<void()> changed_;
  Object<std::uint32_t> cob_id_;
  Object<std::uint8_t> type_;
  Object<std::uint16_t> inhibit_;
  Object<std::uint16_t> event_;
  Object<std::uint8_t> sync_start_;
  Object<std::uint8_t> mapping_count_;
  std::array<Object<std::uint32_t>, kMaxObjects> mapping_;
};

}  // namespace walkman::nodes
