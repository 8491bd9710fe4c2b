#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

using ::testing::HasSubstr;

std::string posture_error(const char* file, const char* state) {
  return message_of([&] { (void)load_posture(kData / file, state, walkman_model()); });
}

TEST(Posture, StatesOfSeveralGroupsAddUp) {
  const auto posture = load_posture(kData / "two_groups.srdf", "ready", walkman_model());
  EXPECT_EQ(posture, (std::map<std::string, double>{{"RElbj", -1.0}, {"LElbj", -1.5}}));
}

TEST(Posture, MissingStateNamesTheNearest) {
  EXPECT_THAT(posture_error("two_groups.srdf", "redy"),
              ::testing::AllOf(HasSubstr("two_groups.srdf"), HasSubstr("\"redy\""), HasSubstr("\"ready\"")));
}

TEST(Posture, BadFiles) {
  EXPECT_THAT(posture_error("bad_unknown_joint.srdf", "home"),
              ::testing::AllOf(HasSubstr("bad_unknown_joint.srdf:4:"), HasSubstr("no joint \"RElbow\"")));
  EXPECT_THAT(posture_error("bad_value.srdf", "home"),
              ::testing::AllOf(HasSubstr("bad_value.srdf:3:"), HasSubstr("RElbj"),
                               HasSubstr("\"nan\" is not finite")));
  EXPECT_THAT(
      posture_error("bad_beyond_limit.srdf", "home"),
      ::testing::AllOf(HasSubstr("bad_beyond_limit.srdf:3:"), HasSubstr("RElbj"), HasSubstr("-2.96706")));
  EXPECT_THAT(posture_error("bad_contradiction.srdf", "home"), HasSubstr("bad_contradiction.srdf:6:"));
  EXPECT_THAT(posture_error("bad_truncated.srdf", "home"), HasSubstr("not well-formed XML"));
  EXPECT_THAT(posture_error("bad_only_a_comment.srdf", "home"), HasSubstr("no element"));
  EXPECT_THAT(posture_error("no_such.srdf", "home"), HasSubstr("no such file"));
}

}  // namespace
}  // namespace walkman::testing
