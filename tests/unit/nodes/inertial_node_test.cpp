#include "emulator/nodes/measuring/inertial_node.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;

InertialParameters ideal() {
  InertialParameters p;
  p.node_id = 91;
  p.name = "imu_link";
  p.serial = 91;
  return p;
}

// Node 91 = 5Bh: SDO 65Bh and 5DBh, TPDOs 1DBh, 2DBh, 3DBh, EMCY 0DBh.
struct InertialNodeTest : testing::Test {
  InertialNodeTest() { talk.listen(milliseconds(2)); }
  InertialNode node{ideal()};
  Conversation talk{node};
};

TEST_F(InertialNodeTest, ThreePdosOfASampleInBytes) {
  talk.ask("000#015B");
  InertialReadings r;
  r.specific_force_S = {0.5, -1.25, 9.81};      // 500 = 01F4h, -1250 = FB1Eh, 9810 = 2652h
  r.angular_velocity_S = {0.1, -0.002, 3};      // 100 = 0064h, -2 = FFFEh, 3000 = 0BB8h
  r.q_WS = Eigen::Quaterniond(0.8, 0, 0.6, 0);  // 24000 = 5DC0h, 18000 = 4650h
  node.sample(r);
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("1DB#F4011EFB52260100", "2DB#6400FEFFB80B00", "3DB#C05D000050460000"));
  // The same rotation with w < 0 is sent with w > 0.
  r.q_WS = Eigen::Quaterniond(-0.8, 0, -0.6, 0);
  node.sample(r);
  EXPECT_THAT(talk.ask("080#").at(2), "3DB#C05D000050460000");
}

TEST_F(InertialNodeTest, DescribesItsChannels) {
  EXPECT_THAT(talk.ask("65B#4000100000000000"), ElementsAre("5DB#4300100094010200"));
  EXPECT_THAT(talk.ask("65B#4030710000000000"), ElementsAre("5DB#4F3071000A000000"));
  EXPECT_THAT(talk.ask("65B#4031610100000000"), ElementsAre("5DB#4331610100022100"));  // N/kg
  EXPECT_THAT(talk.ask("65B#4031610400000000"), ElementsAre("5DB#4331610400031000"));  // rad/s
  EXPECT_THAT(talk.ask("65B#4032610100000000"), ElementsAre("5DB#4F32610103000000"));
  EXPECT_THAT(talk.ask("65B#4032610700000000"), ElementsAre("5DB#8032610711000906"));  // 1/30000 has none
  EXPECT_THAT(talk.ask("65B#4038610100000000"), ElementsAre("5DB#8038610100000206"));  // cannot be tared
}

TEST_F(InertialNodeTest, OverloadSaturatesAndIsReported) {
  talk.ask("000#015B");
  InertialReadings r;
  r.specific_force_S = {40, 0, -40};
  node.sample(r);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("0DB#01FF810000000000", "1DB#007D000000830100",
                                            "2DB#00000000000006", "3DB#3075000000000000"));
  r.specific_force_S = {0, 0, std::numeric_limits<double>::quiet_NaN()};
  node.sample(r);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("0DB#02FF810000000000", "1DB#0000000000830200",
                                            "2DB#00000000000001", "3DB#3075000000000000"));
}

TEST(InertialNode, YawDriftsAndTiltIsOff) {
  InertialParameters p = ideal();
  p.yaw_drift = 0.5;
  p.tilt_error = {0.02, 0};
  InertialNode node(p);
  for (int i = 0; i < 1000; ++i) node.sample({});
  // 0.5 rad about the vertical after the tilt of 0.02 rad about x.
  const auto value = [&](std::uint8_t sub) {
    return from_raw<float>(node.dictionary().find(0x6130, sub)->raw);
  };
  EXPECT_NEAR(value(7), std::cos(0.25) * std::cos(0.01), 5e-5);
  EXPECT_NEAR(value(8), std::cos(0.25) * std::sin(0.01), 5e-5);
  EXPECT_NEAR(value(9), std::sin(0.25) * std::sin(0.01), 5e-5);
  EXPECT_NEAR(value(10), std::sin(0.25) * std::cos(0.01), 5e-5);
}

TEST(InertialNode, NoiseAndBiasHaveTheirSizes) {
  InertialParameters p = ideal();
  p.force_noise = 0.02;
  p.rate_noise = 0.004;
  p.force_bias = {0.05, 0, 0};
  p.rate_bias = {0, 0, -0.01};
  p.noise_seed = 3;
  InertialNode node(p);
  constexpr int kSamples = 4000;
  double force = 0, force_squares = 0, rate = 0, rate_squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    node.sample({});
    const double f = from_raw<float>(node.dictionary().find(0x6130, 1)->raw);
    const double w = from_raw<float>(node.dictionary().find(0x6130, 6)->raw);
    force += f;
    force_squares += f * f;
    rate += w;
    rate_squares += w * w;
  }
  EXPECT_NEAR(force / kSamples, 0.05, 0.0013);  // four standard errors
  EXPECT_NEAR(rate / kSamples, -0.01, 0.0003);
  EXPECT_NEAR(std::sqrt(force_squares / kSamples - std::pow(force / kSamples, 2)), 0.02, 0.001);
  EXPECT_NEAR(std::sqrt(rate_squares / kSamples - std::pow(rate / kSamples, 2)), 0.004, 0.0002);
}

}  // namespace
}  // namespace walkman::nodes
