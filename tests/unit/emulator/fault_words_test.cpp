// A fault as written on the command line and on the control socket.

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/faults/fault_plan.h"

namespace walkman::faults {
namespace {

using testing::ThrowsMessage;

TEST(FaultInWords, ThatComesAgainIsOverBefore) {
  const Injection fault = parse_fault({"joint-locked", "RElbj", "for=1", "every=2"});
  EXPECT_EQ(fault.lasts, 1);
  EXPECT_EQ(fault.every, 2);
  EXPECT_EQ(parse_fault({"joint-locked", "RElbj", "every=1", "for=1"}).every, 1);
  EXPECT_THAT(
      [] {
        static_cast<void>(parse_fault({"joint-locked", "RElbj", "every=2"}));
      },
      ThrowsMessage<std::runtime_error>(
          "joint-locked: every=2, expected for=S as well, with S no longer than that"));
  EXPECT_THAT(
      [] {
        static_cast<void>(parse_fault({"joint-locked", "RElbj", "for=2", "every=1"}));
      },
      ThrowsMessage<std::runtime_error>(
          "joint-locked: every=1, expected for=S as well, with S no longer than that"));
}

}  // namespace
}  // namespace walkman::faults
