#include "drivers/canopen/node_settings.h"

#include <algorithm>

#include <fmt/format.h>

#include "drivers/canopen/objects.h"

namespace walkman::canopen {
namespace {

using Kind = SdoStep::Kind;

constexpr std::uint8_t kEventTimer = 5;  // sub-index of 1400h to 1403h
constexpr int kLeastPeriods = 4;         // of an RPDO; after three the computer reports its cycle as late

std::uint32_t milliseconds_of(Time time) {
  return static_cast<std::uint32_t>(std::chrono::ceil<std::chrono::milliseconds>(time).count());
}

}  // namespace

std::vector<SdoStep> identity_steps(const NodeSettings& settings, std::uint32_t device_type,
                                    std::uint32_t* vendor) {
  const ExpectedIdentity& identity = settings.identity;
  const std::uint32_t type = identity.device_type != 0 ? identity.device_type : device_type;
  std::vector<SdoStep> steps{{Kind::kExpect, {object::kDeviceType, 0}, 4, type, "device type"}};
  if (!identity.vendor) steps.push_back({Kind::kNonZero, {object::kIdentity, 1}, 4, 0, "vendor-ID", vendor});
  const auto expect = [&](std::uint8_t sub, const std::optional<std::uint32_t>& value, const char* what,
                          std::uint32_t* result = nullptr) {
    if (value) steps.push_back({Kind::kExpect, {object::kIdentity, sub}, 4, *value, what, result});
  };
  expect(1, identity.vendor, "vendor-ID", vendor);
  expect(2, identity.product, "product code");
  expect(3, identity.revision, "revision number");
  expect(4, identity.serial, "serial number");
  return steps;
}

std::vector<SdoStep> supervision_steps(const NodeSettings& settings) {
  const std::uint32_t consumer =
      std::uint32_t{kMasterNodeId} << 16U | milliseconds_of(settings.heartbeat_timeout);
  std::vector<SdoStep> steps{
      {Kind::kWrite,
       {object::kProducerHeartbeat, 0},
       2,
       milliseconds_of(settings.heartbeat_producer),
       "heartbeat producer time, ms"},
      {Kind::kWrite, {object::kConsumerHeartbeat, 1}, 4, consumer, "consumer heartbeat time"}};
  for (std::size_t i = 0; i < settings.pdos.receive.size(); ++i) {
    const PdoSettings& pdo = settings.pdos.receive[i];
    if (!pdo.enabled || pdo.event_ms) continue;
    const Time period = settings.cycle * (pdo.cyclic() ? pdo.type : 1);
    steps.push_back({Kind::kWrite,
                     {static_cast<std::uint16_t>(object::kRpdoCommunication + i), kEventTimer},
                     2,
                     milliseconds_of(std::max(settings.rpdo_timeout, kLeastPeriods * period)),
                     fmt::format("RPDO{} deadline, ms", i + 1)});
  }
  if (settings.sync_overflow != 0) {
    steps.push_back({Kind::kWrite,
                     {object::kSyncCounterOverflow, 0},
                     1,
                     settings.sync_overflow,
                     "synchronous counter overflow"});
  }
  return steps;
}

void append(std::vector<SdoStep>& steps, const std::vector<SdoStep>& more) {
  steps.insert(steps.end(), more.begin(), more.end());
}

}  // namespace walkman::canopen
