#include "urdf/reader/nearest_name.h"

#include <gtest/gtest.h>

namespace walkman {
namespace {

TEST(NearestName, FindsTypingMistakes) {
  const std::vector<std::string> keys = {"objects", "fixed_bodies", "robot", "seed"};
  EXPECT_EQ(nearest_name("object", keys), "objects");             // one letter missing
  EXPECT_EQ(nearest_name("fixed_bodeis", keys), "fixed_bodies");  // two letters swapped
  EXPECT_EQ(nearest_name("Robot", keys), "robot");                // different case
  EXPECT_EQ(nearest_name("seeed", keys), "seed");                 // one letter too many
  EXPECT_EQ(nearest_name("weights", keys), "");                   // nothing similar
  EXPECT_EQ(nearest_name("", {}), "");
  EXPECT_EQ(nearest_name(std::string(10'000, 'a'), keys), "");
}

TEST(NearestName, PrefersTheFewestEdits) {
  EXPECT_EQ(nearest_name("RElbow", {"RElb", "RElbj", "RElbows"}), "RElbows");
  EXPECT_EQ(did_you_mean("RElbow", {"RElbows"}), "; did you mean \"RElbows\"?");
  EXPECT_EQ(did_you_mean("RElbow", {"Neck"}), "");
}

}  // namespace
}  // namespace walkman
