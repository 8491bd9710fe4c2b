#include <algorithm>
#include <ctime>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "robots.h"
#include "urdf/reader/text_file.h"
#include "urdf/reader/urdf_reader.h"

namespace walkman::testing {
namespace {

using ::testing::HasSubstr;

struct Bad {
  const char* file;
  int line;  // 0: the message names no line
  std::vector<const char*> parts;

  friend void PrintTo(const Bad& bad, std::ostream* out) { *out << bad.file; }
};

class BadUrdf : public ::testing::TestWithParam<Bad> {};

TEST_P(BadUrdf, IsOneSentenceWithFilePlaceAndReason) {
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  const std::string message = message_of([] { (void)load_robot_model(kData / GetParam().file); });
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  const std::string place = GetParam().line > 0 ? fmt::format("{}:{}: ", GetParam().file, GetParam().line)
                                                : fmt::format("{}: ", GetParam().file);
  EXPECT_THAT(message, HasSubstr(place));
  for (const char* part : GetParam().parts) EXPECT_THAT(message, HasSubstr(part));
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadUrdf,
    ::testing::Values(
        Bad{"bad_no_such_file.urdf", 0, {"no such file"}}, Bad{"bad_empty.urdf", 0, {"empty"}},
        Bad{"bad_truncated.urdf", 4, {"not well-formed XML"}},
        Bad{"bad_not_a_robot.urdf", 1, {"<sdf>", "<robot>"}},
        Bad{"bad_only_a_comment.urdf", 0, {"no element"}}, Bad{"bad_xacro.urdf", 2, {"xacro"}},
        Bad{"bad_nested_too_deep.urdf", 1, {"not well-formed XML"}},
        Bad{"bad_inertia_nan.urdf", 5, {"link \"arm\"", "iyy", "\"nan\" is not finite"}},
        Bad{"bad_mass_infinite.urdf", 3, {"link \"arm\"", "mass", "\"inf\" is not finite"}},
        Bad{"bad_mass_negative.urdf", 3, {"link \"arm\"", "-1 kg"}},
        Bad{"bad_mass_missing.urdf", 3, {"link \"arm\"", "no <mass>"}},
        Bad{"bad_inertia_text.urdf", 3, {"link \"arm\"", "\"0,1\" is not a number"}},
        Bad{"bad_inertia_indefinite.urdf", 3, {"link \"arm\"", "not positive definite"}},
        Bad{"bad_inertia_triangle.urdf", 3, {"link \"arm\"", "triangle inequality", "0.3"}},
        Bad{"bad_inertia_massless.urdf", 3, {"link \"arm\"", "mass is 0 but the inertia is not"}},
        Bad{"bad_contact_negative.urdf", 3, {"link \"arm\", contact", "rolling_friction", "-0.1"}},
        Bad{"bad_contact_restitution.urdf", 3, {"link \"arm\", contact", "restitution", "1.5", "at most 1"}},
        Bad{"bad_box_negative.urdf", 3, {"link \"arm\"", "collision 1", "1 -1 1", "more than 0"}},
        Bad{"bad_geometry_unknown.urdf", 3, {"link \"arm\"", "<capsule>", "box, cylinder, sphere or mesh"}},
        Bad{"bad_geometry_none.urdf", 3, {"link \"arm\"", "no shape"}},
        Bad{"bad_origin_two_numbers.urdf", 3, {"link \"arm\"", "\"0 0\" has 2 numbers, expected 3"}},
        Bad{"bad_joint_floating.urdf", 4, {"joint \"j\"", "\"floating\" is not supported"}},
        Bad{"bad_joint_floating_beside.urdf", 4, {"joint \"j\"", "\"floating\" is not supported"}},
        Bad{"bad_joint_floating_inside.urdf", 4, {"joint \"j\"", "\"floating\" is not supported"}},
        Bad{"bad_latin1.urdf", 2, {"the byte E4h is not UTF-8"}},
        Bad{"bad_attributes.urdf", 2, {"<link>", "71 attributes, expected at most 64"}},
        Bad{"bad_joint_planar.urdf", 4, {"joint \"j\"", "\"planar\" is not supported"}},
        Bad{"bad_joint_limits_missing.urdf", 4, {"joint \"j\"", "no <limit>"}},
        Bad{"bad_joint_limits_swapped.urdf", 4, {"joint \"j\"", "lower 1 is above upper -1"}},
        Bad{"bad_joint_axis_zero.urdf", 4, {"joint \"j\"", "no direction"}},
        Bad{"bad_joint_axis_lines.urdf", 0, {"urdfdom does not accept it: Malformed axis", "\\x0A"}},
        Bad{"bad_joint_damping_negative.urdf", 4, {"joint \"j\"", "damping is -1"}},
        Bad{"bad_joint_parent_unknown.urdf", 4, {"joint \"j\"", "no link \"bass\"", "did you mean \"base\""}},
        Bad{"bad_joint_child_missing.urdf", 4, {"joint \"j\"", "<child"}},
        Bad{"bad_mimic_unknown.urdf", 4, {"joint \"j\"", "no joint \"k\""}},
        Bad{"bad_mimic_circle.urdf", 5, {"joint \"j\"", "loop"}},
        Bad{"bad_link_twice.urdf", 3, {"link \"base\"", "already used in line 2"}},
        Bad{"bad_joint_nameless.urdf", 4, {"<joint>", "no name"}},
        Bad{"bad_two_parents.urdf", 6, {"joint \"k\"", "also the child of another joint"}},
        Bad{"bad_two_roots.urdf", 3, {"link \"base\"", "expected one root"}},
        Bad{"bad_circle.urdf", 3, {"loop"}}, Bad{"bad_no_links.urdf", 1, {"no links"}},
        Bad{"bad_version.urdf", 0, {"urdfdom does not accept it"}},
        Bad{"bad_mesh_missing.urdf", 3, {"link \"arm\"", "tried", "description/meshes/not_there.stl"}},
        Bad{"bad_mesh_truncated.urdf", 3, {"link \"arm\"", "meshes/truncated.stl"}},
        Bad{"bad_mesh_scheme.urdf", 3, {"link \"arm\"", "http://", "unsupported scheme"}}),
    [](const auto& tested) {
      std::string name = tested.param.file;
      return name.substr(4, name.find('.') - 4);
    });

TEST(TextFile, RefusesAFileAboveItsBound) {
  EXPECT_THAT(message_of([] { (void)read_text_file(kData / "bad_two_roots.urdf", 20); }),
              HasSubstr("at most 20"));
  EXPECT_THAT(message_of([] { (void)read_text_file(kData, 20); }), HasSubstr("not a regular file"));
}

TEST(TextFile, WhatIsNoRegularFileIsRefusedBeforeItIsOpened) {
  const auto fifo = std::filesystem::path(::testing::TempDir()) / "walkman_fifo";
  std::filesystem::remove(fifo);
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_THAT(message_of([&] { require_regular_file(fifo); }), HasSubstr("not a regular file but a FIFO"));
  EXPECT_THAT(message_of([&] { require_regular_output(fifo); }), HasSubstr("not a regular file but a FIFO"));
  std::filesystem::remove(fifo);
  EXPECT_THAT(message_of([] { require_regular_file("/dev/zero"); }), HasSubstr("a device"));
  EXPECT_THAT(message_of([] { require_regular_file(kData); }), HasSubstr("a folder"));
  EXPECT_EQ(message_of([&] { require_regular_output(fifo); }), "");
}

// A massless point whose only joint is floating is a notation for the world, not a part of the robot.
TEST(FloatingRoot, TheChildIsTheBase) {
  const RobotModel model = load_robot_model(kData / "floating_root.urdf");
  ASSERT_EQ(model.links.size(), 2U);
  EXPECT_EQ(model.links[0].name, "base");
  EXPECT_EQ(model.links[0].parent_joint, -1);
  EXPECT_DOUBLE_EQ(model.total_mass(), 3);
  ASSERT_EQ(model.joints.size(), 1U);
  EXPECT_EQ(model.joints[0].name, "shoulder");
}

// Each of these exercises a step whose cost may grow with the square of the number of links.
class UrdfCost : public ::testing::TestWithParam<const char*> {
 protected:
  static double seconds(const std::string& kind, int links) {
    const auto file = std::filesystem::path(::testing::TempDir()) / ("walkman_cost_" + kind + ".urdf");
    {
      std::ofstream out(file);
      out << "<robot name=\"many\">\n";
      for (int i = 0; i < links; ++i) {
        out << fmt::format("<link name=\"l{}\"/>\n", i);
        if (i == 0) continue;
        out << fmt::format(
            "<joint name=\"j{0}\" type=\"revolute\"><parent link=\"l{1}\"/><child link=\"l{0}\"/>"
            "<limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"1\"/>",
            i, i % 900 == 1 ? 0 : i - 1);
        if (kind == "leaders" && i > 1) out << fmt::format("<mimic joint=\"j{}\"/>", i - 1);
        if (kind == "unknown_leaders") out << fmt::format("<mimic joint=\"k{}\"/>", i);
        out << "</joint>\n";
      }
      for (int i = 0; i < links && kind == "materials"; ++i)
        out << fmt::format("<material name=\"m{}\"/>\n", i);
      out << "</robot>\n";
    }
    double least = 1e9;
    for (int repeat = 0; repeat < 3; ++repeat) {
      const std::clock_t start = std::clock();
      UrdfReader reader(file, {}, UrdfFindings::OnFinding::kCollect);
      static_cast<void>(link_poses(reader.read(), {}));
      least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    std::filesystem::remove(file);
    return least;
  }
};

TEST_P(UrdfCost, FourTimesTheLinksCostAboutFourTimesAsMuch) {
  const double few = seconds(GetParam(), 2000), many = seconds(GetParam(), 8000);
  EXPECT_LT(many, 8 * few) << few << " s for 2000 links, " << many << " s for 8000";
}

INSTANTIATE_TEST_SUITE_P(Robots, UrdfCost,
                         ::testing::Values("chains", "materials", "leaders", "unknown_leaders"),
                         [](const auto& tested) { return std::string(tested.param); });

TEST(UrdfSize, MoreThan50MegabytesAreRefusedBeforeReading) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "walkman_huge.urdf";
  { std::ofstream{file}; }
  std::filesystem::resize_file(file, 50'000'001);  // sparse: takes no disk space
  EXPECT_THAT(message_of([&] { (void)load_robot_model(file); }),
              HasSubstr("50000001 bytes, expected at most 50000000"));
  std::filesystem::remove(file);
}

TEST(UrdfSize, AChainTooDeepIsRefusedAndALongOneIsRead) {
  const auto chain = [](int links) {
    auto file = std::filesystem::path(::testing::TempDir()) / "walkman_chain.urdf";
    std::ofstream out(file);
    out << "<robot name=\"chain\"><link name=\"l0\"/>";
    for (int i = 1; i < links; ++i)
      out << fmt::format(
          "<link name=\"l{0}\"/><joint name=\"j{0}\" type=\"fixed\"><parent link=\"l{1}\"/>"
          "<child link=\"l{0}\"/></joint>\n",
          i, i - 1);
    out << "</robot>";
    return file;
  };
  EXPECT_EQ(load_robot_model(chain(900)).links.size(), 900U);
  EXPECT_THAT(message_of([&] { (void)load_robot_model(chain(1200)); }), HasSubstr("more than 1000 joints"));
  EXPECT_THAT(message_of([&] { (void)load_robot_model(chain(11000)); }), HasSubstr("expected at most 10000"));
}

}  // namespace
}  // namespace walkman::testing
