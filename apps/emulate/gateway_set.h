#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/emulate/emulation.h"
#include "emulator/gateways/slcan_port.h"
#include "emulator/gateways/socketcand_server.h"

namespace walkman::apps {

struct GatewayOptions {
  std::optional<std::uint16_t> socketcand;  ///< port on 127.0.0.1; 0: any free port
  bool beacon = false;                      ///< socketcand announces itself by UDP broadcasts
  std::vector<std::string> slcan;           ///< "rarm=/tmp/ttyRARM"; without "=...": no symbolic link
};

/// Access to an emulation's buses for tools without CAN support in the kernel.
class GatewaySet {
 public:
  /// Opens the gateways and attaches them to `emulation`, which must outlive them. Throws std::runtime_error
  /// for an unknown bus, EnvironmentError for a port or terminal that is not available.
  GatewaySet(Emulation& emulation, const GatewayOptions& options);

  /// Addresses of the gateways, one per line.
  [[nodiscard]] const std::string& addresses() const noexcept { return addresses_; }

 private:
  std::unique_ptr<gateways::SocketcandServer> socketcand_;
  std::vector<std::unique_ptr<gateways::SlcanPort>> slcan_;
  std::string addresses_;
};

}  // namespace walkman::apps
