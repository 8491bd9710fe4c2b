#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// One little-endian signal. A value is `raw * factor` in `unit`.
struct DbcSignal {
  std::string name;
  int start = 0;   ///< bit
  int length = 0;  ///< bits
  bool is_signed = false;
  bool is_float = false;  ///< IEEE 754, 32 bits
  double factor = 1;
  std::string unit;                                 ///< ASCII
  std::string comment;                              ///< one line, may be empty
  nodes::ObjectAddress object;                      ///< object that it carries; index 0 for none
  std::vector<std::pair<int, std::string>> values;  ///< names of raw values
};

struct DbcMessage {
  std::uint32_t id = 0;
  std::string name;
  int length = 0;  ///< bytes; more than 8 in a CAN FD frame
  std::string sender;
  std::vector<std::string> receivers;
  std::vector<DbcSignal> signals;
  std::string comment;
};

/// The other end of every PDO: the robot's computer.
inline constexpr const char* kComputer = "computer";

/// `name` as a C identifier: other characters become underscores.
[[nodiscard]] std::string identifier(const std::string& name);

/// The PDOs of a device as its dictionary maps them now; RPDOs as seen from the device. PDOs that are off are
/// omitted; a signal that repeats one of an earlier PDO has the PDO's number appended to its name. `device`
/// is an identifier.
[[nodiscard]] std::vector<DbcMessage> pdo_messages(const std::string& device,
                                                   const nodes::ObjectDictionary& dictionary);

/// The services of one device: EMCY, SDO request and response, error control (boot-up, heartbeat).
[[nodiscard]] std::vector<DbcMessage> device_services(const std::string& device, std::uint8_t node_id);

/// NMT, SYNC, TIME and LSS, which serve all devices.
[[nodiscard]] std::vector<DbcMessage> bus_services(const std::vector<std::string>& devices);

}  // namespace walkman::datasheets
