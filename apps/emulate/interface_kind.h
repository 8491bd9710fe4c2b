#pragma once

#include <string>

namespace walkman::apps {

/// Kind of a network interface as the driver that made it calls it, by rtnetlink (IFLA_INFO_KIND): "vcan" or
/// "vxcan" for CAN buses without a wire, "can" for controllers and serial adapters. Empty when the driver has
/// no name for it. Throws std::runtime_error when there is no such interface, or the kernel does not tell.
[[nodiscard]] std::string interface_kind(const std::string& name);

}  // namespace walkman::apps
