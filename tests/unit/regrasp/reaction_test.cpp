#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/regrasp/session.h"

namespace walkman::regrasp {
namespace {

using enum robot::FaultKind;

constexpr std::pair<robot::FaultKind, const char*> kKinds[] = {
    {kDataStale, "kDataStale"},
    {kHeartbeatLost, "kHeartbeatLost"},
    {kBusSilent, "kBusSilent"},
    {kBusFlooded, "kBusFlooded"},
    {kCycleLate, "kCycleLate"},
    {kUnexpectedBootUp, "kUnexpectedBootUp"},
    {kDriveFault, "kDriveFault"},
    {kNmtState, "kNmtState"},
    {kEmergency, "kEmergency"},
    {kSensorInvalid, "kSensorInvalid"},
    {kNotFinite, "kNotFinite"},
    {kNotFollowing, "kNotFollowing"},
    {kLimit, "kLimit"},
    {kInterfaceDown, "kInterfaceDown"},
    {kRequestFailed, "kRequestFailed"},
    {kBusOff, "kBusOff"},
    {kReceiveOverflow, "kReceiveOverflow"},
};

std::string word(Reaction reaction) {
  return fmt::format("{}, {:g} s", reaction == Reaction::kRecover ? "recover" : "safe stop",
                     reacted_within(reaction));
}

TEST(Reaction, IsThatOfTheDocument) {
  std::vector<std::string> expected, found;
  for (const auto& [kind, name] : kKinds)
    expected.push_back(fmt::format("| `{}` | {} | {} |", name, word(reaction_to(kind, false)),
                                   word(reaction_to(kind, true))));
  std::ifstream document("docs/driver_faults.md");
  std::string line;
  while (std::getline(document, line) && line != "| fault | hand empty | object in the hand |") {
  }
  std::getline(document, line);
  while (std::getline(document, line) && line.starts_with("|")) found.push_back(line);
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(expected));
}

TEST(Reaction, NothingIsBootedAnewWithAnObjectInTheHand) {
  for (const auto& [kind, name] : kKinds) EXPECT_EQ(reaction_to(kind, true), Reaction::kStop) << name;
}

}  // namespace
}  // namespace walkman::regrasp
