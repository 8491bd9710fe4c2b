#pragma once

#include <filesystem>
#include <fstream>

#include "emulator/bus/can_bus.h"

namespace walkman::datasheets {

/// What the devices' objects really were whenever a PDO took them up or put them down, as CSV: time in
/// seconds, node-ID, COB-ID, index, sub-index, raw value as a decimal number (bits for REAL32). One row for
/// each mapped object; a TPDO's are written when it is sampled, an RPDO's when it has taken effect. What a
/// CAN log is checked against: times are those of the same clock.
class StateLog {
 public:
  /// Creates or truncates the file. Throws std::runtime_error with the file and the system's reason.
  explicit StateLog(std::filesystem::path file);

  /// Logs the PDOs of every device on `bus` from now on; must outlive the bus's last `advance`.
  void watch(const bus::CanBus& bus);

  /// Brings everything to the file. Throws std::runtime_error when anything so far could not be written.
  void flush();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace walkman::datasheets
