#include "drivers/cia402/drive_mapping.h"

#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "drivers/canopen/objects.h"

namespace walkman::cia402 {
namespace {

namespace object = canopen::object;
using canopen::MappingEntry;
using canopen::PdoDirection;
using canopen::PdoSettings;

struct KnownObject {
  PdoDirection direction;
  MappingEntry object;
  DriveValue value;
  const char* name;
  bool needed;
};

constexpr auto kIn = PdoDirection::kReceive;
constexpr auto kOut = PdoDirection::kTransmit;
constexpr KnownObject kKnown[] = {
    {kOut, {object::kStatusword, 0, 16}, DriveValue::kStatusword, "statusword", true},
    {kOut, {object::kModeDisplay, 0, 8}, DriveValue::kModeDisplay, "mode display", false},
    {kOut, {object::kTorqueActual, 0, 16}, DriveValue::kTorque, "torque", true},
    {kOut, {object::kPositionActual, 0, 32}, DriveValue::kPosition, "position", true},
    {kOut, {object::kVelocityActual, 0, 32}, DriveValue::kVelocity, "velocity", false},
    {kOut, {object::kErrorCode, 0, 16}, DriveValue::kErrorCode, "error code", false},
    {kOut, {object::kTemperatureCompact, 1, 8}, DriveValue::kTemperature, "temperature", false},
    {kOut, {object::kCycleCounter, 1, 16}, DriveValue::kCycleCounter, "cycle counter", false},
    {kIn, {object::kControlword, 0, 16}, DriveValue::kControlword, "controlword", true},
    {kIn, {object::kMode, 0, 8}, DriveValue::kMode, "mode", false},
    {kIn, {object::kTargetTorque, 0, 16}, DriveValue::kTargetTorque, "target torque", false},
    {kIn, {object::kTargetPosition, 0, 32}, DriveValue::kTargetPosition, "target position", true},
    {kIn, {object::kTargetVelocity, 0, 32}, DriveValue::kTargetVelocity, "target velocity", false},
    {kIn, {object::kTorqueOffset, 0, 16}, DriveValue::kTorqueOffset, "torque offset", false},
    {kIn, {object::kMaxTorque, 0, 16}, DriveValue::kMaxTorque, "max torque", false},
};

const KnownObject* find(PdoDirection direction, const MappingEntry& object) {
  for (const KnownObject& known : kKnown) {
    if (known.direction == direction && known.object.index == object.index &&
        known.object.sub == object.sub) {
      return &known;
    }
  }
  return nullptr;
}

bool maps(const PdoSettings& settings, const KnownObject& known) {
  if (!settings.enabled) return false;
  for (const MappingEntry& object : settings.mapping) {
    if (object.index == known.object.index && object.sub == known.object.sub) return true;
  }
  return false;
}

}  // namespace

DriveMapping::DriveMapping(const canopen::DevicePdos& pdos) {
  for (std::size_t i = 0; i < 4; ++i) {
    take(kIn, pdos.receive[i], receive_[i]);
    take(kOut, pdos.transmit[i], transmit_[i]);
  }
  check_presence(pdos);
  check_dividers(pdos);
}

void DriveMapping::take(PdoDirection direction, const PdoSettings& settings,
                        std::vector<DriveField>& fields) {
  if (!settings.enabled) return;
  std::size_t offset = 0;
  for (const MappingEntry& object : settings.mapping) {
    DriveField field;
    field.offset = static_cast<std::uint8_t>(offset);
    field.bytes = object.bits / 8;
    offset += field.bytes;
    if (const KnownObject* known = find(direction, object)) {
      if (known->object.bits != object.bits) {
        throw std::runtime_error(fmt::format("{} ({}) is mapped with {} bits, expected {}", name_of(object),
                                             known->name, object.bits, known->object.bits));
      }
      field.value = known->value;
      present_ |= 1U << static_cast<unsigned>(known->value);
    } else if (direction == kIn && !object.dummy() && object.index != object::kPdoProtection) {
      if (object.bits > 32) {
        throw std::runtime_error(
            fmt::format("{} in an RPDO has {} bits, expected at most 32", name_of(object), object.bits));
      }
      field.value = DriveValue::kKept;
      field.kept = static_cast<std::uint8_t>(kept_.size());
      kept_.push_back(object);
    } else {
      continue;
    }
    fields.push_back(field);
  }
}

void DriveMapping::check_presence(const canopen::DevicePdos& pdos) const {
  for (const KnownObject& known : kKnown) {
    if (!known.needed) continue;
    bool mapped = false;
    bool cyclic = false;
    for (const PdoSettings& settings : known.direction == kIn ? pdos.receive : pdos.transmit) {
      mapped = mapped || maps(settings, known);
      cyclic = cyclic || (maps(settings, known) && settings.cyclic());
    }
    if (!mapped) {
      throw std::runtime_error(fmt::format("no {}PDO carries {} ({})", known.direction == kIn ? "R" : "T",
                                           name_of(known.object), known.name));
    }
    if (known.direction == kOut && !cyclic) {
      throw std::runtime_error(fmt::format("{} ({}) is in no TPDO of transmission type 1 to 240",
                                           name_of(known.object), known.name));
    }
  }
}

void DriveMapping::check_dividers(const canopen::DevicePdos& pdos) {
  int divider = 0;
  for (const auto* all : {&pdos.receive, &pdos.transmit}) {
    for (const PdoSettings& settings : *all) {
      if (!settings.cyclic()) continue;
      if (divider != 0 && divider != settings.type) {
        throw std::runtime_error(
            fmt::format("PDOs have transmission types {} and {}, expected the same for all cyclic PDOs",
                        divider, settings.type));
      }
      divider = settings.type;
    }
  }
  sync_divider_ = divider;
}

canopen::DevicePdos factory_drive_pdos(std::uint8_t n) {
  canopen::DevicePdos pdos = canopen::predefined_pdos();
  enable(pdos.receive[0], 255,
         {{object::kControlword, 0, 16}, {object::kMode, 0, 8}, {object::kTargetTorque, 0, 16}});
  enable(pdos.receive[1], n, {{object::kTargetPosition, 0, 32}, {object::kTargetVelocity, 0, 32}});
  enable(pdos.transmit[0], n,
         {{object::kStatusword, 0, 16}, {object::kModeDisplay, 0, 8}, {object::kTorqueActual, 0, 16}});
  enable(pdos.transmit[1], n, {{object::kPositionActual, 0, 32}, {object::kVelocityActual, 0, 32}});
  enable(pdos.transmit[3], 255,
         {{object::kErrorCode, 0, 16}, {object::kTemperatureCompact, 1, 8}, {object::kCycleCounter, 1, 16}});
  pdos.transmit[3].event_ms = 100;
  return pdos;
}

}  // namespace walkman::cia402
