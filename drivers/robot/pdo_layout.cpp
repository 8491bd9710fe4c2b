#include "drivers/robot/pdo_layout.h"

#include <map>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/canopen/objects.h"
#include "drivers/robot/device_kinds.h"
#include "urdf/reader/yaml_map.h"

namespace walkman::robot {
namespace {

using canopen::DevicePdos;
using canopen::MappingEntry;
using canopen::PdoDirection;
using canopen::PdoSettings;

constexpr std::size_t kClassicalBytes = 8;
constexpr std::size_t kFdBytes = 64;

// Dummy types 0001h..0007h and their bits (CiA 301, table 44).
constexpr int kDummyBits[] = {0, 1, 8, 16, 32, 8, 16, 32};

MappingEntry read_object(const YamlMap& map, PdoDirection direction) {
  MappingEntry object;
  object.index = static_cast<std::uint16_t>(map.hexadecimal("index", 1, 0xFFFF));
  if (map.has("sub")) object.sub = static_cast<std::uint8_t>(map.integer("sub", 0, 254));
  object.bits = static_cast<std::uint8_t>(map.integer("bits", 8, 64));
  if (object.bits != 8 && object.bits != 16 && object.bits != 32 && object.bits != 64) {
    map.fail("bits", fmt::format("found {}, expected 8, 16, 32 or 64", object.bits));
  }
  if (object.index >= 0x1000) return object;
  const bool dummy = object.dummy() && direction == PdoDirection::kReceive && object.sub == 0;
  if (!dummy) {
    map.fail("index",
             fmt::format("{} cannot be mapped here, expected an object from 1000h on, or in an RPDO a "
                         "dummy 0002h to 0007h",
                         name_of(object)));
  }
  if (kDummyBits[object.index] != object.bits) {
    map.fail("bits", fmt::format("found {}, dummy {:04X}h has {}", object.bits, object.index,
                                 kDummyBits[object.index]));
  }
  return object;
}

std::uint8_t read_type(const YamlMap& map, PdoDirection direction) {
  const long long type = map.integer("type", 0, 255);
  const bool remote = type == 252 || type == 253;
  if ((type > 240 && type < 252) || (remote && direction == PdoDirection::kReceive)) {
    map.fail("type", fmt::format("found {}, expected 0 to 240, 254 or 255{}", type,
                                 direction == PdoDirection::kReceive ? "" : ", 252 or 253"));
  }
  return static_cast<std::uint8_t>(type);
}

std::uint32_t read_cob_id_base(const YamlMap& map, PdoDirection direction) {
  const std::uint32_t first = direction == PdoDirection::kReceive ? 0x200 : 0x180;
  const auto base = map.hexadecimal("cob_id_base", 0, 0x7FF);
  for (std::uint32_t allowed = first; allowed <= first + 0x300; allowed += 0x100) {
    if (base == allowed) return allowed;
  }
  map.fail("cob_id_base", fmt::format("found 0x{:X}, expected 0x{:X}, 0x{:X}, 0x{:X} or 0x{:X}", base, first,
                                      first + 0x100, first + 0x200, first + 0x300));
}

PdoSettings read_pdo(const YamlMap& map, PdoDirection direction, bool fd) {
  PdoSettings pdo;
  pdo.enabled = true;
  pdo.cob_id_base = read_cob_id_base(map, direction);
  pdo.type = read_type(map, direction);
  if (map.has("inhibit_us")) {
    const long long us = map.integer("inhibit_us", 0, 6'553'500);
    if (us % 100 != 0) map.fail("inhibit_us", fmt::format("found {}, expected a multiple of 100", us));
    pdo.inhibit_100us = static_cast<std::uint16_t>(us / 100);
  }
  if (map.has("event_ms")) pdo.event_ms = static_cast<std::uint16_t>(map.integer("event_ms", 0, 65535));
  for (const YamlMap& object : map.list("objects", {"index", "sub", "bits"})) {
    pdo.mapping.push_back(read_object(object, direction));
  }
  for (std::size_t i = 0; i < pdo.mapping.size(); ++i) {
    const MappingEntry& object = pdo.mapping[i];
    const bool fits = i + 1 == pdo.mapping.size() && object.sub == 0 && object.bits == 16;
    if (object.index != canopen::object::kPdoProtection || fits) continue;
    map.fail(
        "objects",
        fmt::format("found {} (protection) with {} bits in place {} of {}, expected it last, with 16 bits",
                    name_of(object), object.bits, i + 1, pdo.mapping.size()));
  }
  if (pdo.mapping.empty()) map.fail("objects", "the list is empty, expected an object");
  const std::size_t limit = fd ? kFdBytes : kClassicalBytes;
  if (pdo.mapping.size() > limit) {
    map.fail("objects", fmt::format("{} objects, expected at most {}", pdo.mapping.size(), limit));
  }
  if (pdo.bytes() > limit) {
    map.fail("objects", fmt::format("{} bytes in all, expected at most {} in a {} frame", pdo.bytes(), limit,
                                    fd ? "CAN FD" : "classical"));
  }
  return pdo;
}

std::array<PdoSettings, 4> read_pdos(const YamlMap& device, const char* key, PdoDirection direction,
                                     bool fd) {
  std::array<PdoSettings, 4> pdos{};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t first = direction == PdoDirection::kReceive ? 0x200 : 0x180;
    pdos[i].cob_id_base = static_cast<std::uint32_t>(first + 0x100 * i);
  }
  std::map<std::uint32_t, long long> bases;
  for (const YamlMap& map :
       device.list(key, {"number", "cob_id_base", "type", "inhibit_us", "event_ms", "objects"})) {
    const long long number = map.integer("number", 1, 4);
    PdoSettings& pdo = pdos[static_cast<std::size_t>(number - 1)];
    if (pdo.enabled) map.fail("number", fmt::format("PDO {} already exists", number));
    pdo = read_pdo(map, direction, fd);
    const auto [other, is_new] = bases.emplace(pdo.cob_id_base, number);
    if (!is_new) {
      map.fail("cob_id_base",
               fmt::format("0x{:X} is already used by PDO {}", pdo.cob_id_base, other->second));
    }
  }
  return pdos;
}

DevicePdos read_device(const YamlMap& top, const DeviceKindName& kind, bool fd) {
  if (!kind.drive && !top.has(kind.name)) return driver_of(kind.kind).factory_pdos();
  const YamlMap map = kind.drive ? top.map(kind.name, {"rpdos", "tpdos"}) : top.map(kind.name, {"tpdos"});
  DevicePdos pdos;
  if (kind.drive) {
    pdos.receive = read_pdos(map, "rpdos", PdoDirection::kReceive, fd);
    pdos.write_receive = true;
  }
  pdos.transmit = read_pdos(map, "tpdos", PdoDirection::kTransmit, fd);
  pdos.write_transmit = true;
  try {
    driver_of(kind.kind).check(pdos);
  } catch (const std::runtime_error& error) {
    map.fail("", error.what());
  }
  return pdos;
}

}  // namespace

PdoLayout factory_layout() {
  PdoLayout layout;
  layout.name = "factory";
  for (const DeviceKindName& kind : kDeviceKinds)
    layout.kinds[kind.kind] = driver_of(kind.kind).factory_pdos();
  return layout;
}

PdoLayout load_pdo_layout(const std::filesystem::path& yaml_file) {
  std::vector<std::string> keys{"name", "can_fd"};
  for (const DeviceKindName& kind : kDeviceKinds) keys.emplace_back(kind.name);
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "", keys);
  PdoLayout layout;
  layout.name = top.text("name");
  layout.fd = top.flag("can_fd");
  for (const DeviceKindName& kind : kDeviceKinds) layout.kinds[kind.kind] = read_device(top, kind, layout.fd);
  return layout;
}

}  // namespace walkman::robot
