#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "emulator/nodes/canopen_slave.h"

namespace walkman::device_files {

/// What the devices' objects really were whenever a PDO took them up or put them down, as CSV: bus, time in
/// seconds, node-ID, COB-ID, index, sub-index, raw value as a decimal number (bits for REAL32). One row for
/// each mapped object; a TPDO's are written when it is sampled, an RPDO's when it takes effect. What a CAN
/// log is checked against.
class StateLog {
 public:
  /// Creates or truncates the file. Throws std::runtime_error with the file and the system's reason.
  explicit StateLog(std::filesystem::path file);

  /// Logs the PDOs of `node` from now on; the log must outlive it. `bus` is the name in the first column.
  void watch(const std::string& bus, nodes::CanopenSlave& node);

  /// Brings everything to the file. Throws std::runtime_error when anything so far could not be written.
  void flush();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace walkman::device_files
