// Types, access, mappability and limits of a drive's objects, against the profile's table.

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/nodes/cia301/object_table.h"
#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

struct Row {
  unsigned index, sub;
  DataType type;
  bool writable, mappable;
};

constexpr auto kI8 = DataType::kInteger8;
constexpr auto kI16 = DataType::kInteger16;
constexpr auto kI32 = DataType::kInteger32;
constexpr auto kU8 = DataType::kUnsigned8;
constexpr auto kU16 = DataType::kUnsigned16;
constexpr auto kU32 = DataType::kUnsigned32;

using DriveObjectsTest = JointRig;

TEST_F(DriveObjectsTest, EveryObjectHasItsTypeAccessAndMappability) {
  const std::vector<Row> table = {
      {0x2000, 1, kU32, false, false}, {0x2000, 2, kU32, false, false}, {0x2000, 3, kU16, false, false},
      {0x2000, 4, kU16, false, false}, {0x2010, 1, kU32, true, false},  {0x2010, 2, kU32, true, false},
      {0x2010, 3, kU32, false, false}, {0x2010, 4, kU32, false, false}, {0x2011, 1, kU16, true, true},
      {0x2011, 2, kU16, true, true},   {0x2020, 1, kI32, false, true},  {0x2020, 2, kI32, false, true},
      {0x2020, 3, kU32, false, false}, {0x2030, 1, kI16, false, true},  {0x2030, 2, kI16, false, true},
      {0x2030, 3, kI16, true, false},  {0x2030, 4, kI16, true, false},  {0x2031, 1, kI8, false, true},
      {0x2032, 1, kU32, true, false},  {0x2032, 2, kU32, true, false},  {0x2040, 1, kU32, true, false},
      {0x2040, 2, kU32, true, false},  {0x2040, 3, kU32, true, false},  {0x2041, 1, kU32, true, false},
      {0x2041, 2, kU32, true, false},  {0x2041, 3, kU32, true, false},  {0x2042, 1, kU32, true, false},
      {0x2042, 2, kU32, true, false},  {0x2042, 3, kU32, true, false},  {0x2050, 1, kU16, false, true},
      {0x6007, 0, kI16, true, false},  {0x603F, 0, kU16, false, true},  {0x6040, 0, kU16, true, true},
      {0x6041, 0, kU16, false, true},  {0x605A, 0, kI16, true, false},  {0x605B, 0, kI16, true, false},
      {0x605C, 0, kI16, true, false},  {0x605D, 0, kI16, true, false},  {0x605E, 0, kI16, true, false},
      {0x6060, 0, kI8, true, true},    {0x6061, 0, kI8, false, true},   {0x6062, 0, kI32, false, true},
      {0x6063, 0, kI32, false, true},  {0x6064, 0, kI32, false, true},  {0x6065, 0, kU32, true, false},
      {0x6066, 0, kU16, true, false},  {0x6067, 0, kU32, true, false},  {0x6068, 0, kU16, true, false},
      {0x606B, 0, kI32, false, true},  {0x606C, 0, kI32, false, true},  {0x606D, 0, kU16, true, false},
      {0x606E, 0, kU16, true, false},  {0x606F, 0, kU16, true, false},  {0x6070, 0, kU16, true, false},
      {0x6071, 0, kI16, true, true},   {0x6072, 0, kU16, true, true},   {0x6073, 0, kU16, true, false},
      {0x6074, 0, kI16, false, true},  {0x6075, 0, kU32, false, false}, {0x6076, 0, kU32, false, false},
      {0x6077, 0, kI16, false, true},  {0x6078, 0, kI16, false, true},  {0x6079, 0, kU32, false, true},
      {0x607A, 0, kI32, true, true},   {0x607C, 0, kI32, true, false},  {0x607D, 1, kI32, true, false},
      {0x607D, 2, kI32, true, false},  {0x607F, 0, kU32, true, false},  {0x6080, 0, kU32, true, false},
      {0x6081, 0, kU32, true, false},  {0x6083, 0, kU32, true, false},  {0x6084, 0, kU32, true, false},
      {0x6085, 0, kU32, true, false},  {0x6086, 0, kI16, true, false},  {0x6087, 0, kU32, true, false},
      {0x6088, 0, kI16, true, false},  {0x608F, 1, kU32, false, false}, {0x608F, 2, kU32, false, false},
      {0x6091, 1, kU32, false, false}, {0x6091, 2, kU32, false, false}, {0x6092, 1, kU32, false, false},
      {0x6092, 2, kU32, false, false}, {0x6098, 0, kI8, true, false},   {0x6099, 1, kU32, true, false},
      {0x6099, 2, kU32, true, false},  {0x609A, 0, kU32, true, false},  {0x60A8, 0, kU32, false, false},
      {0x60A9, 0, kU32, false, false}, {0x60B0, 0, kI32, true, true},   {0x60B1, 0, kI32, true, true},
      {0x60B2, 0, kI16, true, true},   {0x60C0, 0, kI16, true, false},  {0x60C1, 1, kI32, true, true},
      {0x60C2, 1, kU8, true, false},   {0x60C2, 2, kI8, true, false},   {0x60E3, 1, kI8, false, false},
      {0x60E3, 2, kI8, false, false},  {0x60E4, 1, kI32, false, true},  {0x60E5, 1, kI32, false, true},
      {0x60F4, 0, kI32, false, true},  {0x60FD, 0, kU32, false, true},  {0x60FE, 1, kU32, true, true},
      {0x60FE, 2, kU32, true, true},   {0x60FF, 0, kI32, true, true},   {0x6402, 0, kU16, false, false},
      {0x6502, 0, kU32, false, false}};
  for (const Row& row : table) {
    SCOPED_TRACE(testing::Message() << std::hex << row.index << "h:" << row.sub);
    const Entry* entry =
        node.dictionary().find(static_cast<std::uint16_t>(row.index), static_cast<std::uint8_t>(row.sub));
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->type, row.type);
    EXPECT_EQ(entry->writable(), row.writable);
    EXPECT_TRUE(entry->readable());
    EXPECT_EQ(entry->mappable == Mappable::kYes, row.mappable);
    if (row.sub != 0) {
      const Entry* count = node.dictionary().find(static_cast<std::uint16_t>(row.index), 0);
      ASSERT_NE(count, nullptr);
      EXPECT_GE(count->raw, row.sub);
      EXPECT_EQ(node.dictionary().find(static_cast<std::uint16_t>(row.index),
                                       static_cast<std::uint8_t>(count->raw + 1)),
                nullptr);
    }
  }
}

// The CAN FD layout: RPDO of 19 and TPDO of 21 bytes.
TEST_F(DriveObjectsTest, TheLargeLayoutCanBeMapped) {
  const std::vector<std::pair<unsigned, unsigned>> commands = {
      {0x6040, 0}, {0x6060, 0}, {0x607A, 0}, {0x60FF, 0}, {0x60B2, 0}, {0x2011, 1}, {0x2011, 2}};
  const std::vector<std::pair<unsigned, unsigned>> answers = {
      {0x6041, 0}, {0x6061, 0}, {0x6064, 0}, {0x606C, 0}, {0x6077, 0}, {0x60E4, 1}, {0x2020, 2}};
  const auto bytes = [&](const auto& list, bool writable) {
    std::size_t sum = 0;
    for (const auto& [index, sub] : list) {
      const Entry* entry =
          node.dictionary().find(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub));
      EXPECT_EQ(entry->mappable, Mappable::kYes);
      EXPECT_EQ(entry->writable(), writable);
      sum += entry->size();
    }
    return sum;
  };
  EXPECT_EQ(bytes(commands, true), 17U);
  EXPECT_EQ(bytes(answers, false), 21U);
}

TEST_F(DriveObjectsTest, IdentityAndScale) {
  DriveParameters q = test_drive();
  q.model_hash = 0xCAFE1234;
  q.joint_number = 14;
  q.bus_number = 2;
  DriveNode other(q);
  Conversation with(other);
  with.listen(milliseconds(2));
  EXPECT_THAT(with.ask("605#4000200200000000"), ElementsAre("585#430020023412FECA"));
  EXPECT_THAT(with.ask("605#4000200300000000"), ElementsAre("585#4B0020030E000000"));
  EXPECT_THAT(with.ask("605#4000200400000000"), ElementsAre("585#4B00200402000000"));
  // 6064h = 6063h x 6092h / (608Fh x 6091h).
  joint.motor = joint.link = 1.234567;
  run(0.001);
  const double increments = read_signed(0x6063);
  const double scale = static_cast<double>(read(0x6092, 1)) / read(0x6092, 2) /
                       (static_cast<double>(read(0x608F, 1)) / read(0x608F, 2)) /
                       (static_cast<double>(read(0x6091, 1)) / read(0x6091, 2));
  EXPECT_NEAR(increments * scale, 1'234'567, 2);
}

TEST_F(DriveObjectsTest, GainsAreUsedAndBounded) {
  // P = J w^2 = 0.3 (2 pi 25)^2 = 7402.2 N·m/rad, D = 2 J w = 94.25 N·m·s/rad.
  EXPECT_NEAR(read(0x2040, 1), 7'402'203, 1);
  EXPECT_NEAR(read(0x2040, 3), 94'248, 1);
  EXPECT_EQ(write(0x2040, 1, 40'000'000, 4), 0x06090031U);
  EXPECT_EQ(write(0x2040, 3, 400'000, 4), 0x06090031U);
  EXPECT_EQ(write(0x2042, 1, 4001, 4), 0x06090031U);
  joint.link_locked = true;
  // Half the gain: half the torque for the same error.
  const auto torque_at_error = [&] {
    enable();
    run(0.01);
    ServoFeedback f = joint.sense(p);
    f.motor_velocity = 0;
    const double before = node.control(f, kStep);
    f.motor_position -= 1e-3;
    const double pushed = node.control(f, kStep);
    control(0);
    return pushed - before;
  };
  EXPECT_NEAR(torque_at_error(), 7.402, 1e-3);
  EXPECT_EQ(write(0x2040, 1, 3'701'101, 4), 0U);
  EXPECT_NEAR(torque_at_error(), 3.701, 1e-3);
  EXPECT_EQ(write(0x2040, 1, 0, 4), 0U);
  EXPECT_NEAR(torque_at_error(), 0, 1e-9);
}

TEST_F(DriveObjectsTest, TheIntegralOfThePositionLoopTakesUpAnOffset) {
  EXPECT_EQ(write(0x2040, 2, 50'000'000, 4), 0U);  // 50000 N·m/(rad s)
  EXPECT_EQ(write(0x60B2, 0, 100, 2), 0U);         // 10 N·m too much
  enable();
  run(2);
  EXPECT_NEAR(joint.motor, 0, 1e-4);
  EXPECT_EQ(write(0x2040, 2, 0, 4), 0U);
  run(1);
  EXPECT_NEAR(joint.motor, 10 / 7402.2, 1e-4);
}

TEST_F(DriveObjectsTest, TheProportionalTorqueGainStiffensTheTorqueLoop) {
  joint.link_locked = true;
  enable("0A");
  write(0x6071, 0, 100, 2);
  const auto rise = [&] {
    int steps = 0;
    while (p.spring_constant * joint.motor < 8 && steps < 4000) step(), ++steps;
    return steps;
  };
  const int plain = rise();
  write(0x6071, 0, 0, 2);
  run(1);
  EXPECT_EQ(write(0x2042, 1, 2000, 4), 0U);
  write(0x6071, 0, 100, 2);
  EXPECT_LT(rise(), 0.8 * plain);
  run(1);
  EXPECT_NEAR(p.spring_constant * joint.motor, 10, 0.05);
}

TEST_F(DriveObjectsTest, LimitsCannotCross) {
  EXPECT_EQ(write(0x607D, 1, 2'000'001, 4), 0x06090036U);
  EXPECT_EQ(write(0x607D, 2, -2'000'001, 4), 0x06090036U);
  EXPECT_EQ(write(0x607F, 0, 6'000'001, 4), 0x06090031U);
  EXPECT_EQ(write(0x6080, 0, 0, 4), 0x06090032U);
}

// Against the standard library's rounding.
TEST(WireUnits, RoundsHalfAwayFromZeroAndSaturates) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-3e9, 3e9), small(-4, 4);
  for (int i = 0; i < 200'000; ++i) {
    for (const double value : {any(random), small(random), std::round(small(random) * 2) / 2}) {
      const double expected = std::clamp(std::round(value), -2147483648.0, 2147483647.0);
      ASSERT_EQ(to_wire<std::int32_t>(value, 1.0), static_cast<std::int32_t>(expected)) << value;
    }
  }
  EXPECT_EQ(to_wire<std::int32_t>(0.49999999999999994, 1.0), 0);
  EXPECT_EQ(to_wire<std::int32_t>(std::numeric_limits<double>::quiet_NaN(), 1.0), 0);
  EXPECT_EQ(to_wire<std::int16_t>(-std::numeric_limits<double>::infinity(), 1.0), -32768);
  EXPECT_EQ(to_wire<std::uint32_t>(std::numeric_limits<double>::infinity(), 1.0), UINT32_MAX);
  EXPECT_EQ(to_wire<std::uint32_t>(-0.4, 1.0), 0U);
  EXPECT_EQ(to_wire<std::uint16_t>(65535.4, 1.0), 65535);
}

}  // namespace
}  // namespace walkman::nodes
