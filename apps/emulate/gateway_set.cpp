#include "apps/emulate/gateway_set.h"

#include <stdexcept>

#include <fmt/format.h>

#include "apps/shared/exit_code.h"
#include "urdf/reader/nearest_name.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

bus::CanBus& bus_named(Emulation& emulation, const std::string& name) {
  std::vector<std::string> known;
  for (bus::CanBus* bus : emulation.emulator().buses()) {
    if (bus->name() == name) return *bus;
    known.push_back(bus->name());
  }
  throw std::runtime_error(fmt::format("--slcan: no bus '{}', expected one of {}{}", name,
                                       fmt::join(known, ", "), did_you_mean(name, known)));
}

template <typename Gateway>
void attach(Emulation& emulation, Gateway& gateway) {
  emulation.attach(
      gateway.descriptor(), [&gateway] { gateway.service(); }, [&gateway] { gateway.forward(); });
}

}  // namespace

GatewaySet::GatewaySet(Emulation& emulation, const GatewayOptions& options) {
  if (options.socketcand) {
    gateways::SocketcandOptions settings;
    settings.port = *options.socketcand;
    settings.beacon = options.beacon;
    const std::vector<bus::CanBus*> buses = emulation.emulator().buses();
    try {
      socketcand_ = std::make_unique<gateways::SocketcandServer>(buses, settings);
    } catch (const std::runtime_error& e) {
      throw EnvironmentError(e.what());
    }
    attach(emulation, *socketcand_);
    addresses_ += fmt::format("socketcand: {}\n", socketcand_->address());
  }
  for (const std::string& item : options.slcan) {
    const std::size_t equals = item.find('=');
    bus::CanBus& bus = bus_named(emulation, item.substr(0, equals));
    const std::string link = equals == std::string::npos ? "" : item.substr(equals + 1);
    try {
      slcan_.push_back(std::make_unique<gateways::SlcanPort>(bus, link));
    } catch (const std::runtime_error& e) {
      throw EnvironmentError(e.what());
    }
    attach(emulation, *slcan_.back());
    addresses_ +=
        fmt::format("slcan {}: {}\n", bus.name(), one_line(link.empty() ? slcan_.back()->terminal() : link));
  }
}

}  // namespace walkman::apps
