#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

#include "emulator/bus/can_bus.h"

namespace walkman::datasheets {

/// Logs the actual values of the devices' objects whenever a PDO reads or writes them, as CSV: time in
/// seconds, node-ID, COB-ID, index, sub-index, raw value as a decimal number (bits for REAL32). One row for
/// each mapped object; rows of a TPDO are written when it is sampled, those of an RPDO when it has taken
/// effect. Reference for checking a CAN log: times are on the same clock.
class StateLog {
 public:
  /// Creates or truncates the file. `note`: one line, written before the names of the columns as a comment
  /// that begins with "# "; omitted if empty. Throws std::runtime_error with the file and the system's
  /// reason.
  explicit StateLog(std::filesystem::path file, std::string_view note = {});

  /// Logs the PDOs of every device on `bus` from now on; must outlive the bus's last `advance`.
  void watch(const bus::CanBus& bus);

  /// Flushes everything to the file. Throws std::runtime_error if anything so far could not be written.
  void flush();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace walkman::datasheets
