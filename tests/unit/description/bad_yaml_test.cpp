#include <fmt/format.h>
#include <gmock/gmock.h>

#include "emulator/scene/scene.h"
#include "robots.h"
#include "urdf/reader/device_table.h"

namespace walkman::testing {
namespace {

using ::testing::HasSubstr;

struct BadYaml {
  const char* file;
  int line;  // 0: the message names no line
  std::vector<const char*> parts;

  friend void PrintTo(const BadYaml& bad, std::ostream* out) { *out << bad.file; }
};

void expect_message(const std::string& message, const BadYaml& bad) {
  EXPECT_THAT(message, HasSubstr(bad.line > 0 ? fmt::format("{}:{}: ", bad.file, bad.line)
                                              : fmt::format("{}: ", bad.file)));
  for (const char* part : bad.parts) EXPECT_THAT(message, HasSubstr(part));
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

std::string test_name(const ::testing::TestParamInfo<BadYaml>& tested) {
  const std::string name = tested.param.file;
  return name.substr(4, name.find('.') - 4);
}

class BadScene : public ::testing::TestWithParam<BadYaml> {};

TEST_P(BadScene, IsOneSentenceWithFileLineAndKey) {
  expect_message(message_of([] { (void)load_scene(kData / GetParam().file); }), GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadScene,
    ::testing::Values(
        BadYaml{"bad_scene_no_such.yaml", 0, {"no such file"}},
        BadYaml{"bad_scene_syntax.yaml", 3, {"not well-formed YAML"}},
        BadYaml{"bad_scene_misspelt_key.yaml", 7, {"objets", "unknown key", "did you mean \"objects\""}},
        BadYaml{"bad_scene_unknown_key.yaml", 8, {"gravity", "expected one of extends, robot, fixed_bodies"}},
        BadYaml{"bad_scene_key_twice.yaml", 8, {"seed", "twice"}},
        BadYaml{"bad_scene_missing_key.yaml", 2, {"robot", "\"posture\" is missing"}},
        BadYaml{"bad_scene_wrong_type.yaml", 4, {"robot.base.xyz_m", "a list of 2", "3 numbers"}},
        BadYaml{"bad_scene_nan.yaml", 8, {"jitter.x_m", "\"nan\" is not finite"}},
        BadYaml{"bad_scene_number_with_zero.yaml", 8, {"jitter.x_m", R"("0.01\x00" is not a number)"}},
        BadYaml{"bad_scene_two_lines.yaml", 4, {"robot.base.kind", R"("fixed\x0Aflying", expected fixed)"}},
        BadYaml{"bad_scene_dot_nan.yaml", 8, {"jitter.x_m", ".nan"}},
        BadYaml{"bad_scene_negative_jitter.yaml", 8, {"jitter.x_m", "negative"}},
        BadYaml{
            "bad_scene_base_kind.yaml", 4, {"robot.base.kind", "\"flying\"", "fixed, floating or hoisted"}},
        BadYaml{"bad_scene_urdf_missing.yaml", 2, {"robot.file", "no file", "nowhere.yaml"}},
        BadYaml{"bad_scene_weight_off.yaml",
                14,
                {"objects[0].weights[0].from_left_end_m", "1.2 m is off the object"}},
        BadYaml{"bad_scene_weight_massless.yaml", 13, {"objects[0].weights[0].urdf", "no mass"}},
        BadYaml{"bad_scene_name_twice.yaml", 11, {"objects[0].name", "\"bar\""}},
        BadYaml{"bad_scene_weight_link.yaml",
                15,
                {"objects[0].weights[0].link", "no link \"baar\"", "did you mean \"bar\""}},
        BadYaml{"bad_scene_weight_twice_placed.yaml",
                15,
                {"objects[0].weights[0].xyz_m", "from_left_end_m is also given"}},
        BadYaml{"bad_scene_extends_itself.yaml", 1, {"extends", "also extends this file"}},
        BadYaml{"bad_scene_contact.yaml", 12, {"objects[1].contact.restitution", "-0.1", "expected 0 to 1"}},
        BadYaml{"bad_scene_parameters.yaml", 8, {"parameters", "no file", "nowhere.yaml"}},
        BadYaml{"bad_scene_extends_nothing.yaml", 1, {"extends", "no file", "nowhere.yaml"}},
        BadYaml{"bad_scene_extends_weight_off.yaml",
                6,
                {"objects[0].weights[0].from_left_end_m", "1.2 m is off the object"}},
        BadYaml{"bad_scene_event_phase_and_time.yaml", 14, {"events[0]", "either at_s or in_phase"}},
        BadYaml{"bad_scene_event_channel.yaml", 15, {"events[0].sensor_fault.swap", "\"Tu\"", "Fx, Fy"}},
        BadYaml{"bad_scene_event_gains.yaml", 15, {"events[0].sensor_fault.gain", "list of 6 numbers"}},
        BadYaml{"bad_scene_event_bit.yaml",
                15,
                {"events[0].sensor_fault.bit", "either stuck_at or flipped_share"}},
        BadYaml{
            "bad_scene_event_occurrence.yaml", 14, {"events[0].in_phase.occurrence", "whole number from 1"}},
        BadYaml{"bad_scene_nested_too_deep.yaml", 2, {"nested too deep"}},
        BadYaml{"bad_scene_latin1.yaml", 2, {"the byte E9h is not UTF-8"}},
        BadYaml{"bad_scene_list.yaml", 1, {"a list of 2", "expected a mapping"}},
        BadYaml{"bad_scene_seed.yaml", 7, {"seed", "\"-1\"", "whole number"}},
        BadYaml{"bad_scene_model_error_level.yaml",
                7,
                {"model_error", "\"perfect\"", "none, calibrated, uncalibrated"}},
        BadYaml{"bad_scene_model_error_base.yaml", 7, {"model_error", "\"base\" is missing"}},
        BadYaml{"bad_scene_model_error_key.yaml",
                9,
                {"model_error.joint_zero", "did you mean \"joint_zero_rad\""}},
        BadYaml{
            "bad_scene_model_error_negative.yaml", 9, {"model_error.joint_zero_rad", "expected 0 to 0.5"}},
        BadYaml{"bad_scene_model_error_large.yaml", 9, {"model_error.link_mass.sigma", "expected 0 to 0.5"}},
        BadYaml{
            "bad_scene_model_error_outliers.yaml", 9, {"model_error.spring.outliers", "two rising numbers"}},
        BadYaml{"bad_scene_model_error_parts.yaml", 7, {"model_error.weighed_parts", "true or false"}},
        BadYaml{"bad_scene_rope_fixed.yaml", 4, {"robot.base.rope", "the base is fixed"}},
        BadYaml{"bad_scene_rope_length.yaml", 4, {"robot.base.rope.length_m", "more than 0 m"}},
        BadYaml{"bad_scene_event_list.yaml", 14, {"events", "a mapping", "expected a list"}},
        BadYaml{"bad_scene_event_none.yaml", 14, {"events[0]", "none of push, move_weight, remove_weight"}},
        BadYaml{"bad_scene_event_two.yaml", 14, {"events[0]", "more than one of push"}},
        BadYaml{"bad_scene_event_time.yaml", 14, {"events[0].at_s", "-1 s"}},
        BadYaml{"bad_scene_event_key.yaml", 15, {"events[0].pusch", "did you mean \"push\""}},
        BadYaml{"bad_scene_event_force.yaml", 15, {"events[0].push.force_N", ".inf"}},
        BadYaml{"bad_scene_event_hard.yaml", 15, {"events[0].push.force_N", "at most 100000 N"}},
        BadYaml{"bad_scene_event_duration.yaml", 15, {"events[0].push.duration_s", "more than 0"}},
        BadYaml{"bad_scene_event_object.yaml",
                15,
                {"events[0].remove_weight.object", "no object \"bat\"", "did you mean \"bar\""}},
        BadYaml{"bad_scene_event_weight.yaml",
                15,
                {"events[0].move_weight.weight", "no weight \"left_wieght\"", "\"left_weight\""}},
        BadYaml{"bad_scene_event_off.yaml",
                15,
                {"events[0].move_weight.from_left_end_m", "1.4 m is off the object"}},
        BadYaml{"bad_scene_event_gone.yaml",
                14,
                {"events[0]", "\"left_weight\" is already taken off before 2 s"}}),
    test_name);

TEST(BadSceneObject, NamesTheObjectsFile) {
  EXPECT_THAT(message_of([] { (void)load_scene(kData / "bad_scene_bad_object.yaml"); }),
              ::testing::AllOf(HasSubstr("bad_mass_negative.urdf:3:"), HasSubstr("-1 kg")));
}

class BadDevices : public ::testing::TestWithParam<BadYaml> {};

TEST_P(BadDevices, IsOneSentenceWithFileLineAndKey) {
  expect_message(message_of([] { (void)load_device_table(kData / GetParam().file, walkman_model()); }),
                 GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadDevices,
    ::testing::Values(
        BadYaml{
            "bad_devices_bit_rate.yaml", 4, {"buses[0].bit_rate", "300000 bit/s", "1000000, 800000, 500000"}},
        BadYaml{"bad_devices_bit_rate_high.yaml", 4, {"buses[0].bit_rate", "8000000000"}},
        BadYaml{"bad_devices_fd_word.yaml", 4, {"buses[0].fd", "\"maybe\"", "true or false"}},
        BadYaml{"bad_devices_data_rate_alone.yaml", 4, {"buses[0].data_bit_rate", "fd: true"}},
        BadYaml{"bad_devices_data_rate.yaml", 5, {"buses[0].data_bit_rate", "3000000 bit/s", "5000000"}},
        BadYaml{"bad_devices_unknown_joint.yaml",
                5,
                {"buses[0].devices[0].joint", "no joint \"RElbow\"", "\"RElbj\""}},
        BadYaml{
            "bad_devices_unknown_frame.yaml", 5, {"force_torque", "no frame \"r_arm_tf\"", "\"r_arm_ft\""}},
        BadYaml{"bad_devices_fixed_joint.yaml", 5, {"imu_joint", "does not move"}},
        BadYaml{"bad_devices_passive_joint.yaml", 5, {"RThumbFlexion1", "follows \"r_handj_synergy\""}},
        BadYaml{"bad_devices_node_range.yaml", 5, {"node", "\"127\"", "1 to 126"}},
        BadYaml{"bad_devices_node_twice.yaml", 6, {"node", "11 is already the node-ID of \"RShSag\""}},
        BadYaml{"bad_devices_joint_twice.yaml", 6, {"\"RShSag\" already has a device"}},
        BadYaml{"bad_devices_interface_long.yaml", 3, {"interface", "expected 1 to 15"}},
        BadYaml{"bad_devices_interface_slash.yaml", 3, {"interface", "\"../can0\" is not a valid name"}},
        BadYaml{"bad_devices_interface_blank.yaml", 3, {"interface", "\"can 0\" is not a valid name"}},
        BadYaml{"bad_devices_interface_dot.yaml", 3, {"interface", "\".\" is not a valid name"}},
        BadYaml{"bad_devices_interface_dots.yaml", 3, {"interface", "\"..\" is not a valid name"}},
        BadYaml{"bad_devices_interface_ascii.yaml", 3, {"interface", "ASCII only"}},
        BadYaml{"bad_devices_interface_colon.yaml", 3, {"interface", "\"can:0\" is not a valid name"}},
        BadYaml{"bad_devices_interface_escape.yaml", 3, {"interface", "is not a valid name"}},
        BadYaml{"bad_devices_bus_name_slash.yaml", 2, {"name", "is not a valid name"}},
        BadYaml{"bad_devices_bus_name_long.yaml", 2, {"name", "has 22 characters, expected 1 to 15"}},
        BadYaml{"bad_devices_sensor_missing.yaml", 5, {"\"sensor\" is missing"}},
        BadYaml{"bad_devices_two_kinds.yaml", 5, {"expected only one of them"}},
        BadYaml{"bad_devices_no_kind.yaml", 5, {"joint, hand, force_torque, imu"}},
        BadYaml{"bad_devices_imu_frame.yaml", 5, {"imu", "no frame \"imu_lnk\"", "\"imu_link\""}},
        BadYaml{"bad_devices_imu_torque.yaml", 5, {"actuator", "given for a sensor"}},
        BadYaml{"bad_devices_sensor_torque.yaml", 5, {"rated_torque_mnm", "given for a sensor"}},
        BadYaml{"bad_devices_torque.yaml", 5, {"rated_torque_mnm", "\"0\""}},
        BadYaml{"bad_devices_empty.yaml", 4, {"devices", "empty"}}),
    test_name);

}  // namespace
}  // namespace walkman::testing
