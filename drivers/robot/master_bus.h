#pragma once

#include <memory>
#include <stdexcept>
#include <vector>

#include "drivers/can/restamped_interface.h"
#include "drivers/can/socket_can.h"

namespace walkman::apps {

/// One bus as a master on a kernel's interface sees it: the socket, and in lock-step the stamps of the cycle.
struct MasterBus {
  explicit MasterBus(std::unique_ptr<can::SocketCan> opened)
      : socket(std::move(opened)), restamped(*socket) {}
  std::unique_ptr<can::SocketCan> socket;
  can::RestampedInterface restamped;
};

using MasterBuses = std::vector<std::unique_ptr<MasterBus>>;

/// The run was ended from outside, by a signal.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace walkman::apps
