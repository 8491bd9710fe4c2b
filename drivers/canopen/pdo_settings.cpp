#include "drivers/canopen/pdo_settings.h"

#include <fmt/format.h>

#include "drivers/canopen/node_settings.h"
#include "drivers/canopen/objects.h"

namespace walkman::canopen {
namespace {

constexpr std::uint32_t kInvalid = 0x80000000U;
constexpr std::uint32_t kNoRemote = 0x40000000U;  // in a TPDO: no remote request

constexpr std::uint8_t kCobId = 1;
constexpr std::uint8_t kType = 2;
constexpr std::uint8_t kInhibitTime = 3;
constexpr std::uint8_t kEventTime = 5;

/// Collects the writes for a PDO, and reads that check the same values afterwards.
class PdoWriter {
 public:
  PdoWriter(PdoDirection direction, int number)
      : transmit_(direction == PdoDirection::kTransmit),
        communication_(static_cast<std::uint16_t>(
            (transmit_ ? object::kTpdoCommunication : object::kRpdoCommunication) + number - 1)),
        mapping_(static_cast<std::uint16_t>(communication_ + 0x200)),
        name_(fmt::format("{}PDO{}", transmit_ ? "T" : "R", number)) {}

  [[nodiscard]] std::uint32_t cob_id(std::uint32_t id) const { return id | (transmit_ ? kNoRemote : 0U); }
  void communication(std::uint8_t sub, std::uint8_t size, std::uint32_t value, const char* what) {
    step({communication_, sub}, size, value, what);
  }
  void mapping(std::uint8_t sub, std::uint32_t value, const std::string& what) {
    step({mapping_, sub}, sub == 0 ? std::uint8_t{1} : std::uint8_t{4}, value, what);
  }
  /// Returns the writes, then one read of every entry that expects the value written last.
  [[nodiscard]] std::vector<SdoStep> finish() const {
    std::vector<SdoStep> all = writes_;
    for (std::size_t i = 0; i < writes_.size(); ++i) {
      bool again = false;
      for (std::size_t k = i + 1; k < writes_.size(); ++k)
        again = again || writes_[k].address == writes_[i].address;
      if (again) continue;
      all.push_back(writes_[i]);
      all.back().kind = SdoStep::Kind::kExpect;
    }
    return all;
  }

 private:
  void step(ObjectAddress address, std::uint8_t size, std::uint32_t value, const std::string& what) {
    writes_.push_back({SdoStep::Kind::kWrite, address, size, value, name_ + " " + what});
  }

  bool transmit_;
  std::uint16_t communication_, mapping_;
  std::string name_;
  std::vector<SdoStep> writes_;
};

}  // namespace

bool PdoSettings::protects() const noexcept {
  return enabled && !mapping.empty() && mapping.back().index == object::kPdoProtection;
}

std::size_t PdoSettings::bytes() const noexcept {
  std::size_t bits = 0;
  for (const MappingEntry& object : mapping) bits += object.bits;
  return bits / 8;
}

DevicePdos predefined_pdos() {
  DevicePdos pdos;
  for (std::size_t i = 0; i < 4; ++i) {
    pdos.receive[i].cob_id_base = static_cast<std::uint32_t>(0x200 + 0x100 * i);
    pdos.transmit[i].cob_id_base = static_cast<std::uint32_t>(0x180 + 0x100 * i);
  }
  return pdos;
}

void enable(PdoSettings& pdo, std::uint8_t type, std::vector<MappingEntry> mapping) {
  pdo.enabled = true;
  pdo.type = type;
  pdo.mapping = std::move(mapping);
}

std::vector<SdoStep> pdo_steps(PdoDirection direction, int number, const PdoSettings& settings,
                               std::uint8_t node_id) {
  PdoWriter writer(direction, number);
  const std::uint32_t cob_id = writer.cob_id(settings.cob_id_base + node_id);
  writer.communication(kCobId, 4, cob_id | kInvalid, "COB-ID");
  if (!settings.enabled) return writer.finish();
  writer.mapping(0, 0, "number of mapped objects");
  for (std::size_t i = 0; i < settings.mapping.size(); ++i) {
    writer.mapping(static_cast<std::uint8_t>(i + 1), settings.mapping[i].entry(),
                   fmt::format("mapping of {}", name_of(settings.mapping[i])));
  }
  writer.mapping(0, static_cast<std::uint32_t>(settings.mapping.size()), "number of mapped objects");
  writer.communication(kType, 1, settings.type, "transmission type");
  if (settings.inhibit_100us) writer.communication(kInhibitTime, 2, *settings.inhibit_100us, "inhibit time");
  if (settings.event_ms) writer.communication(kEventTime, 2, *settings.event_ms, "event timer");
  writer.communication(kCobId, 4, cob_id, "COB-ID");
  return writer.finish();
}

std::vector<SdoStep> pdo_steps(const DevicePdos& pdos, std::uint8_t node_id) {
  std::vector<SdoStep> all;
  for (int number = 1; number <= 4; ++number) {
    const auto i = static_cast<std::size_t>(number - 1);
    if (pdos.write_receive) append(all, pdo_steps(PdoDirection::kReceive, number, pdos.receive[i], node_id));
    if (pdos.write_transmit)
      append(all, pdo_steps(PdoDirection::kTransmit, number, pdos.transmit[i], node_id));
  }
  return all;
}

std::string name_of(const MappingEntry& object) {
  return fmt::format("{:04X}h:{}", object.index, object.sub);
}

}  // namespace walkman::canopen
