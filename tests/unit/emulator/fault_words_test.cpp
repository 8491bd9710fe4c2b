// A fault as written on the command line and on the control socket, and the random stream that it gets.

#include <cstdint>
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

/// The value comes from a separate script: FNV-1a with 64 bits, of the name's bytes and then of the seed's
/// eight, the lowest first.
TEST(FaultsRandomStream, IsThatOfItsNameAndSeed) {
  Injection fault;
  fault.name = "frame-drop-1";
  fault.seed = 7;
  EXPECT_EQ(fault.stream_seed(), 0xF5FC69D15C2C4A7DU);
  const std::uint64_t own = fault.stream_seed();
  fault.seed = 8;
  EXPECT_NE(fault.stream_seed(), own);
  fault.seed = 7;
  fault.name = "frame-drop-2";
  EXPECT_NE(fault.stream_seed(), own);
}

}  // namespace
}  // namespace walkman::faults
