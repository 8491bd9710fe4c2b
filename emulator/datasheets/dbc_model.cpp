#include "emulator/datasheets/dbc_model.h"

#include <cctype>
#include <set>

#include <fmt/format.h>

#include "drivers/can/frame.h"
#include "emulator/datasheets/object_names.h"
#include "emulator/datasheets/wire_unit.h"
#include "emulator/nodes/cia301/communication_table.h"

namespace walkman::datasheets {
namespace {

constexpr int kPdos = 512;
constexpr std::uint16_t kFirstApplicationObject = 0x1000;

bool is_signed(nodes::DataType type) {
  return type == nodes::DataType::kInteger8 || type == nodes::DataType::kInteger16 ||
         type == nodes::DataType::kInteger32 || type == nodes::DataType::kReal32;
}

/// Names of the values of 6060h and 6061h (CiA 402-2; -1 is specific to this device).
std::vector<std::pair<int, std::string>> value_names(nodes::ObjectAddress address) {
  if (address.index != 0x6060 && address.index != 0x6061) return {};
  return {{-1, "impedance"},
          {0, "no mode"},
          {1, "profile position"},
          {3, "profile velocity"},
          {4, "torque profile"},
          {6, "homing"},
          {7, "interpolated position"},
          {8, "cyclic synchronous position"},
          {9, "cyclic synchronous velocity"},
          {10, "cyclic synchronous torque"}};
}

DbcSignal signal_of(const std::string& device, const nodes::ObjectDictionary& dictionary,
                    const nodes::Entry& entry, int start, int length) {
  const nodes::ObjectAddress address = entry.address;
  const WireUnit unit = wire_unit(dictionary, entry);
  DbcSignal signal;
  signal.name = identifier(device + '_' + entry_symbol(dictionary, entry));
  signal.start = start;
  signal.length = length;
  signal.is_signed = is_signed(entry.type);
  signal.is_float = entry.type == nodes::DataType::kReal32;
  signal.factor = unit.factor;
  signal.unit = unit.text;
  signal.object = address;
  signal.values = value_names(address);
  const std::string object = object_name(entry);
  const std::string name = entry_name(dictionary, entry);
  signal.comment = fmt::format("{:04X}h:{:02X}h {}{}", address.index, address.sub, object,
                               name == object ? "" : ", " + name);
  return signal;
}

std::string type_text(std::uint32_t type) {
  if (type == 0) return "with the next SYNC after a change";
  if (type <= 240) return type == 1 ? "every SYNC" : fmt::format("every {} SYNCs", type);
  return type >= 254 ? "by event" : "on remote request";
}

/// Raw value of an entry, 0 if it does not exist.
std::uint32_t value(const nodes::ObjectDictionary& dictionary, int index, std::uint8_t sub) {
  const nodes::Entry* entry = dictionary.find(static_cast<std::uint16_t>(index), sub);
  return entry == nullptr ? 0 : entry->raw;
}

void append_pdos(std::vector<DbcMessage>& messages, const std::string& device,
                 const nodes::ObjectDictionary& dictionary, bool transmit) {
  const int communication = transmit ? 0x1800 : 0x1400;
  const int mapping = transmit ? 0x1A00 : 0x1600;
  for (int i = 0; i < kPdos; ++i) {
    const std::uint32_t count = value(dictionary, mapping + i, 0);
    const std::uint32_t cob_id = value(dictionary, communication + i, 1);
    if (count == 0 || (cob_id & nodes::kCobIdInvalid) != 0) continue;
    DbcMessage message;
    message.id = cob_id & nodes::kCobIdMask;
    message.name = fmt::format("{}_{}PDO{}", device, transmit ? 'T' : 'R', i + 1);
    message.sender = transmit ? device : std::string(kComputer);
    message.receivers = {transmit ? std::string(kComputer) : device};
    message.comment = fmt::format("{}PDO{} of {}, {}", transmit ? 'T' : 'R', i + 1, device,
                                  type_text(value(dictionary, communication + i, 2)));
    int start = 0;
    for (std::uint32_t n = 1; n <= count; ++n) {
      const std::uint32_t mapped = value(dictionary, mapping + i, static_cast<std::uint8_t>(n));
      const auto index = static_cast<std::uint16_t>(mapped >> 16U);
      const int bits = static_cast<int>(mapped & 0xFFU);
      const nodes::Entry* entry = dictionary.find(index, static_cast<std::uint8_t>(mapped >> 8U & 0xFFU));
      // A dummy entry takes up space and has no signal.
      if (index >= kFirstApplicationObject && entry != nullptr)
        message.signals.push_back(signal_of(device, dictionary, *entry, start, bits));
      start += bits;
    }
    message.length = can::fd_length(static_cast<std::size_t>(start + 7) / 8);
    messages.push_back(std::move(message));
  }
}

}  // namespace

std::string identifier(const std::string& name) {
  std::string out = name;
  for (char& c : out)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  if (out.empty() || std::isdigit(static_cast<unsigned char>(out.front())) != 0) out.insert(out.begin(), '_');
  return out;
}

std::vector<DbcMessage> pdo_messages(const std::string& device, const nodes::ObjectDictionary& dictionary) {
  std::vector<DbcMessage> messages;
  for (const bool transmit : {false, true}) append_pdos(messages, device, dictionary, transmit);
  std::set<std::string> names;
  for (DbcMessage& message : messages) {
    for (DbcSignal& signal : message.signals) {
      const std::string plain = signal.name;
      if (names.count(plain) != 0) signal.name = plain + message.name.back();
      for (int again = 2; !names.insert(signal.name).second; ++again)
        signal.name = fmt::format("{}{}_{}", plain, message.name.back(), again);
    }
  }
  return messages;
}

}  // namespace walkman::datasheets
