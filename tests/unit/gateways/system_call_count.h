#pragma once

namespace walkman::gateways::test {

/// Number of system calls that the gateways have made to wait, read, write and set timers.
extern int system_calls;

}  // namespace walkman::gateways::test
