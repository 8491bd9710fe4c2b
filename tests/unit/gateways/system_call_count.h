#pragma once

namespace walkman::gateways::test {

/// Calls of the system that the gateways have made: those to wait, read, write and set timers.
extern int system_calls;

}  // namespace walkman::gateways::test
