#include "drivers/canopen/identity.h"

#include "drivers/canopen/objects.h"

namespace walkman::canopen {

std::vector<SdoStep> identity_steps(const ExpectedIdentity& identity) {
  using Kind = SdoStep::Kind;
  std::vector<SdoStep> steps{
      {Kind::kExpect, {object::kDeviceType, 0}, 4, identity.device_type, "device type"}};
  if (!identity.vendor) steps.push_back({Kind::kNonZero, {object::kIdentity, 1}, 4, 0, "vendor-ID"});
  const auto expect = [&](std::uint8_t sub, const std::optional<std::uint32_t>& value, const char* what) {
    if (value) steps.push_back({Kind::kExpect, {object::kIdentity, sub}, 4, *value, what});
  };
  expect(1, identity.vendor, "vendor-ID");
  expect(2, identity.product, "product code");
  expect(3, identity.revision, "revision number");
  expect(4, identity.serial, "serial number");
  return steps;
}

}  // namespace walkman::canopen
