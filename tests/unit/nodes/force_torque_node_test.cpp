#include "emulator/nodes/measuring/force_torque_node.h"

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;

struct ForceTorqueNodeTest : testing::Test {
  ForceTorqueNodeTest() { talk.listen(milliseconds(2)); }
  void sample(double fx, double fy, double fz, double tx, double ty, double tz) {
    Wrench w;
    w.force = {fx, fy, fz};
    w.torque = {tx, ty, tz};
    node.sample(w);
  }
  float real(unsigned index, unsigned sub) {
    char text[32];
    std::snprintf(text, sizeof text, "612#40%02X%02X%02X00000000", index & 0xFFU, index >> 8U, sub);
    const std::string data = talk.ask(text).at(0).substr(12);
    std::uint32_t raw = 0;
    for (std::size_t i = 4; i > 0; --i) {
      raw = raw << 8U | static_cast<std::uint32_t>(std::stoul(data.substr(2 * i - 2, 2), nullptr, 16));
    }
    return std::bit_cast<float>(raw);
  }
  ForceTorqueNode node{[] {
    ForceTorqueParameters p;
    p.node_id = 18;
    p.name = "RWrist FT";
    p.serial = 18;
    return p;
  }()};
  Conversation talk{node};
};

TEST_F(ForceTorqueNodeTest, BothPdosOfASampleInBytes) {
  talk.ask("000#0112");
  // Before any sample: invalid.
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#0000000000000000", "292#00000000000001"));
  sample(12.0, -3.0, 100.0, 0.5, -0.25, 1.0);
  // 120 = 0078h, -30 = FFE2h, 1000 = 03E8h, counter 1; 50 = 0032h, -25 = FFE7h, 100 = 0064h.
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#7800E2FFE8030100", "292#3200E7FF640000"));
  sample(12.0, -3.0, 100.0, 0.5, -0.25, 1.0);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#7800E2FFE8030200", "292#3200E7FF640000"));
}

TEST_F(ForceTorqueNodeTest, AFaultTurnsTheReadingsThatItTurnsInBytes) {
  talk.ask("000#0112");
  ReadingFault::Parameters fault;
  fault.matrix.setIdentity();
  fault.matrix(0, 0) = 1.3;
  fault.matrix.row(3).swap(fault.matrix.row(4));
  ReadingFault turned = node.make_fault(fault);
  node.faults().add(turned);
  sample(10.0, 0, 0, 0.5, -0.25, 0);
  // 130 = 0082h; Tx -25 = FFE7h, Ty 50 = 0032h.
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#8200000000000100", "292#E7FF3200000000"));
  fault = {};
  fault.bit = ReadingFault::Bit{4, 6, true};  // 64 of Ty's hundredths of a newton metre
  node.faults().remove(turned);
  ReadingFault stuck = node.make_fault(fault);
  node.faults().add(stuck);
  sample(0, 0, 0, 0, 0.1, 0);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#0000000000000200", "292#00004A00000000"));  // 10 | 64
  sample(0, 0, 0, 0, -0.1, 0);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#0000000000000300", "292#0000F6FF000000"));  // bit set in -10
  node.faults().remove(stuck);
  sample(0, 0, 0, 0, 0.1, 0);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#0000000000000400", "292#00000A00000000"));
}

TEST_F(ForceTorqueNodeTest, DriftAddsUpAndBitsFlipAsOftenAsTheyShould) {
  Vector6 units;
  units << 0.1, 0.1, 0.1, 0.01, 0.01, 0.01;
  ReadingFault::Parameters drifting;
  drifting.drift[5] = 0.02;
  ReadingFault drift(drifting, units, 1e-3);
  ReadingFaults drifts;
  drifts.add(drift);
  double last = 0;
  for (int i = 0; i < 2000; ++i) last = drifts.apply(Vector6::Zero())[5];
  EXPECT_NEAR(last, 0.04, 1e-9);
  ReadingFault::Parameters flipping;
  flipping.bit = ReadingFault::Bit{0, 3, {}, 0.05};
  ReadingFault flip(flipping, units, 1e-3);
  ReadingFaults flips;
  flips.add(flip);
  int flipped = 0;
  const int count = 20'000;
  for (int i = 0; i < count; ++i) {
    const double reading = flips.apply(Vector6::Zero())[0];
    EXPECT_TRUE(reading == 0 || std::abs(reading - 0.8) < 1e-12) << reading;
    flipped += reading != 0 ? 1 : 0;
  }
  EXPECT_NEAR(flipped, 0.05 * count, 4 * std::sqrt(0.05 * 0.95 * count));
}

TEST_F(ForceTorqueNodeTest, EachOfItsFaultsKeepsItsOwnTimeAndItsOwnDraws) {
  const auto readings = [&](bool more) {
    ReadingFault::Parameters drifting, noisy, turning;
    drifting.drift[0] = 3;
    noisy.noise[1] = 2;
    noisy.seed = 7;
    turning.matrix(2, 2) = -1;
    turning.noise[3] = 1;
    ReadingFault drift = node.make_fault(drifting), noise = node.make_fault(noisy),
                 turn = node.make_fault(turning);
    ReadingFaults faults;
    faults.add(drift);
    faults.add(noise);
    std::vector<Vector6> out;
    for (int i = 0; i < 300; ++i) {
      if (more && i == 100) faults.add(turn);
      if (more && i == 200) faults.remove(turn);
      out.push_back(faults.apply(Vector6::Ones()));
    }
    return out;
  };
  const std::vector<Vector6> two = readings(false), three = readings(true);
  EXPECT_NEAR(two.back()[0], 1 + 0.9, 1e-9);  // 3 N/s for 0.3 s
  EXPECT_EQ(three[150][2], -1);
  for (std::size_t i = 0; i < two.size(); ++i) EXPECT_EQ(two[i].head<2>(), three[i].head<2>()) << i;
}

TEST_F(ForceTorqueNodeTest, AFrozenReadingStaysSoWhateverElseBreaks) {
  ReadingFault::Parameters sticking, noisy, sticking_too;
  sticking.forces_stuck = true;
  sticking_too.forces_stuck = sticking_too.torques_stuck = true;
  noisy.noise.setOnes();
  ReadingFault first = node.make_fault(sticking), noise = node.make_fault(noisy),
               second = node.make_fault(sticking_too);
  ReadingFaults faults;
  faults.add(first);
  EXPECT_EQ(faults.apply(Vector6::Constant(1))[0], 1);
  faults.add(noise);
  EXPECT_EQ(faults.apply(Vector6::Constant(2))[0], 1);
  EXPECT_NE(faults.apply(Vector6::Constant(2))[5], 2);
  faults.remove(noise);
  faults.add(second);
  EXPECT_EQ(faults.apply(Vector6::Constant(3))[5], 3);
  const Vector6 frozen = faults.apply(Vector6::Constant(4));
  EXPECT_EQ(frozen[0], 1);
  EXPECT_EQ(frozen[5], 3);
  // The second froze what the first had left.
  faults.remove(first);
  EXPECT_EQ(faults.apply(Vector6::Constant(5))[0], 1);
  // One that comes again freezes what is there then.
  faults.remove(second);
  second.start();
  faults.add(second);
  EXPECT_EQ(faults.apply(Vector6::Constant(6))[0], 6);
  EXPECT_EQ(faults.apply(Vector6::Constant(7))[0], 6);
}

TEST_F(ForceTorqueNodeTest, IdentityUnitsAndDigits) {
  EXPECT_THAT(talk.ask("612#4000100000000000"), ElementsAre("592#4300100094010200"));
  EXPECT_THAT(talk.ask("612#4031610100000000"), ElementsAre("592#4331610100002100"));
  EXPECT_THAT(talk.ask("612#4032610100000000"), ElementsAre("592#4F32610101000000"));
  EXPECT_THAT(talk.ask("612#4032610600000000"), ElementsAre("592#4F32610602000000"));
}

TEST_F(ForceTorqueNodeTest, ValuesAreThoseTheSensorResolves) {
  sample(0.37, 0.36, -0.38, 0.0074, 0.0076, 0.0059);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 0.25F);
  EXPECT_FLOAT_EQ(real(0x6130, 2), 0.25F);
  EXPECT_FLOAT_EQ(real(0x6130, 3), -0.5F);
  EXPECT_FLOAT_EQ(real(0x6130, 4), 0.005F);
  EXPECT_FLOAT_EQ(real(0x6130, 5), 0.01F);
  EXPECT_FLOAT_EQ(real(0x6130, 6), 0.004F);
}

TEST_F(ForceTorqueNodeTest, TareByCommandAndByValue) {
  sample(50, 0, -20, 0, 2, 0);
  EXPECT_THAT(talk.ask("612#2339610100000000"), ElementsAre("592#8039610130000906"));
  EXPECT_THAT(talk.ask("612#2339610174617261"), ElementsAre("592#6039610100000000"));
  EXPECT_THAT(talk.ask("612#2339610574617261"), ElementsAre("592#6039610500000000"));
  EXPECT_THAT(talk.ask("612#4039610100000000"), ElementsAre("592#8039610101000106"));
  EXPECT_FLOAT_EQ(real(0x6138, 1), 50);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 0);
  EXPECT_FLOAT_EQ(real(0x6100, 1), 50);
  sample(55, 0, -20, 0, 2.5, 0);
  talk.ask("000#0112");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#3200000038FF0200", "292#00003200000000"));
  // -20 N as the tare of channel 3: C1A00000h.
  EXPECT_THAT(talk.ask("612#233861030000A0C1"), ElementsAre("592#6038610300000000"));
  EXPECT_FLOAT_EQ(real(0x6130, 3), 0);
  // Reset node clears the tare.
  talk.ask("000#8112");
  sample(55, 0, -20, 0, 2.5, 0);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 55);
}

TEST_F(ForceTorqueNodeTest, OverloadSaturatesAndIsReported) {
  talk.ask("000#0112");
  sample(0, 0, 0, 0, -40, 0);
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("092#01FF810000000000", "192#0000000000000100", "292#000054F2000004"));
  EXPECT_FLOAT_EQ(real(0x6130, 5), -35);
  EXPECT_THAT(talk.ask("612#4050610500000000"), ElementsAre("592#4F50610504000000"));
  EXPECT_THAT(talk.ask("612#4050610400000000"), ElementsAre("592#4F50610400000000"));
  sample(2000, 0, 0, 0, 0, 0);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("192#983A000000000200", "292#00000000000002"));
  sample(0, 0, 0, 0, 0, 0);
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("092#0000000000000000", "192#0000000000000300", "292#00000000000000"));
}

TEST_F(ForceTorqueNodeTest, NotANumberAndOffAreInvalid) {
  talk.ask("000#0112");
  sample(10, 0, 0, 0, 0, 0);
  sample(std::numeric_limits<double>::quiet_NaN(), 0, 0, 0, 0, 0);
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("092#02FF810000000000", "192#6400000000000200", "292#00000000000001"));
  talk.ask("612#2F12610200000000");
  sample(0, 7, 0, 0, 0, 0);
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("092#0000000000000000", "192#0000000000000300", "292#00000000000001"));
}

TEST_F(ForceTorqueNodeTest, LowPassHasItsTimeConstant) {
  talk.ask("612#2FA0610300000000");
  talk.ask("612#2FA0610301000000");
  talk.ask("612#2BA1610314000000");  // 20 ms
  sample(0, 0, 0, 0, 0, 0);
  for (int i = 0; i < 20; ++i) sample(0, 0, 1000, 0, 0, 0);
  EXPECT_NEAR(real(0x6130, 3), 1000 * (1 - std::exp(-1.0)), 0.01);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 0);
}

TEST_F(ForceTorqueNodeTest, SecondOrderLowPassIsTwoOfTheFirst) {
  talk.ask("612#2FA0610302000000");
  EXPECT_THAT(talk.ask("612#2FA0610303000000"), ElementsAre("592#80A0610331000906"));  // there is no third
  talk.ask("612#2BA1610314000000");                                                    // 20 ms
  sample(0, 0, 0, 0, 0, 0);
  double slope = 0;
  double last = 0;
  for (int i = 0; i < 40; ++i) {
    sample(0, 0, 1000, 0, 0, 0);
    slope = std::max(slope, real(0x6130, 3) - last);
    last = real(0x6130, 3);
  }
  // Step response 1 - (1 + t/T) exp(-t/T), here at most one sample late in each of the two filters.
  EXPECT_NEAR(last, 1000 * (1 - 3 * std::exp(-2.0)), 1000 * std::exp(-2.0) * 2 / 20 + 1);
  EXPECT_NEAR(slope, 1000 / 20.0 * std::exp(-1.0), 1);  // steepest at t = T
}

TEST_F(ForceTorqueNodeTest, TemperatureOverSdo) {
  EXPECT_THAT(talk.ask("612#4034200100000000"), ElementsAre("592#4B342001FA000000"));  // 25.0 degC
  ForceTorqueParameters p;
  p.node_id = 18;
  p.transducer.ambient_c = -5;
  p.transducer.warm_up = 30;
  p.transducer.warm_up_time = 0.5;
  ForceTorqueNode warming(p);
  Conversation other{warming};
  other.listen(milliseconds(2));
  EXPECT_THAT(other.ask("612#4034200100000000"), ElementsAre("592#4B342001CEFF0000"));  // -5.0 degC
  for (int i = 0; i < 500; ++i) warming.sample({});
  // -5 + 30 (1 - 1/e) = 13.96: 140 = 8Ch.
  EXPECT_THAT(other.ask("612#4034200100000000"), ElementsAre("592#4B3420018C000000"));
}

TEST_F(ForceTorqueNodeTest, ScalingZeroAndTareAddUp) {
  sample(100, 0, 0, 0, 0, 0);
  // Factor 2 (40000000h), scaling offset -30 (C1F00000h), input offset 5 (40A00000h): 2 x 100 - 30 + 5.
  EXPECT_THAT(talk.ask("612#2326610100000040"), ElementsAre("592#6026610100000000"));
  EXPECT_THAT(talk.ask("612#232761010000F0C1"), ElementsAre("592#6027610100000000"));
  EXPECT_THAT(talk.ask("612#232461010000A040"), ElementsAre("592#6024610100000000"));
  EXPECT_FLOAT_EQ(real(0x6100, 1), 100);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 175);
  EXPECT_FLOAT_EQ(real(0x6140, 1), 175);
  EXPECT_THAT(talk.ask("612#4000710100000000"), ElementsAre("592#4B007101E8030000"));  // 1000
  EXPECT_THAT(talk.ask("612#4030710100000000"), ElementsAre("592#4B307101D6060000"));  // 1750
  EXPECT_THAT(talk.ask("612#4030910100000000"), ElementsAre("592#43309101D6060000"));
  // Zero: the input offset absorbs the rest; the tare comes on top of it.
  EXPECT_THAT(talk.ask("612#2325610174617261"), ElementsAre("592#8025610130000906"));
  EXPECT_THAT(talk.ask("612#232561017A65726F"), ElementsAre("592#6025610100000000"));
  EXPECT_FLOAT_EQ(real(0x6124, 1), -170);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 0);
  sample(110, 0, 0, 0, 0, 0);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 20);
  EXPECT_THAT(talk.ask("612#2339610174617261"), ElementsAre("592#6039610100000000"));
  EXPECT_FLOAT_EQ(real(0x6138, 1), 20);
  EXPECT_FLOAT_EQ(real(0x6130, 1), 0);
  EXPECT_THAT(talk.ask("612#2326610100000000"), ElementsAre("592#8026610130000906"));  // factor 0
  EXPECT_THAT(talk.ask("612#232661010000C07F"), ElementsAre("592#8026610130000906"));  // not a number
  EXPECT_THAT(talk.ask("612#4025610100000000"), ElementsAre("592#8025610101000106"));
}

TEST_F(ForceTorqueNodeTest, EventsOfDeltaAndLimitsSendEventDrivenPdos) {
  // TPDO1 on events; delta 5 N (40A00000h) on Fx, limits -20 N (C1A00000h) and 30 N (41F00000h) on Fz.
  for (const char* request : {"612#23001801920100C0", "612#2F001802FF000000", "612#2300180192010040",
                              "612#233361010000A040", "612#233461030000A0C1", "612#233561030000F041"}) {
    EXPECT_EQ(talk.ask(request).at(0).substr(4, 2), "60") << request;
  }
  EXPECT_THAT(talk.ask("612#2334610300007042"), ElementsAre("592#8034610336000906"));  // 60 above 30
  EXPECT_THAT(talk.ask("612#233361010000A0C0"), ElementsAre("592#8033610130000906"));  // -5
  EXPECT_THAT(talk.ask("000#0112"), ElementsAre("192#0000000000000000"));
  const auto heard = [&] { return talk.listen(milliseconds(2)); };
  sample(4, 0, 0, 0, 0, 0);
  EXPECT_THAT(heard(), testing::IsEmpty());
  sample(5.5, 0, 0, 0, 0, 0);  // more than 5 N from 0
  EXPECT_THAT(heard(), ElementsAre("192#3700000000000200"));
  sample(1, 0, 0, 0, 0, 0);
  EXPECT_THAT(heard(), testing::IsEmpty());
  sample(5, 0, 31, 0, 0, 0);  // above the upper limit
  EXPECT_THAT(heard(), ElementsAre("192#3200000036010400"));
  sample(5, 0, 40, 0, 0, 0);
  EXPECT_THAT(heard(), testing::IsEmpty());
  sample(5, 0, -21, 0, 0, 0);  // below the lower
  EXPECT_THAT(heard(), ElementsAre("192#320000002EFF0600"));
  sample(5, 0, 0, 0, 0, 0);
  EXPECT_THAT(heard(), ElementsAre("192#3200000000000700"));
}

TEST_F(ForceTorqueNodeTest, ASensorWithoutAReadingReportsAFault) {
  talk.ask("000#0112");
  sample(0, 0, 0, 0, std::numeric_limits<double>::infinity(), 0);
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("092#02FF810000000000"));
  sample(0, 0, 0, 0, 0, 0);
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("092#0000000000000000"));
  // A channel that is off cannot miss a reading.
  talk.ask("612#2F12610500000000");
  sample(0, 0, 0, 0, std::numeric_limits<double>::infinity(), 0);
  EXPECT_THAT(talk.listen(milliseconds(2)), testing::IsEmpty());
}

TEST_F(ForceTorqueNodeTest, DescribesItsChannels) {
  EXPECT_THAT(talk.ask("612#4010610100000000"), ElementsAre("592#4B10610110270000"));  // 10000
  EXPECT_THAT(talk.ask("612#4010610600000000"), ElementsAre("592#4B10610611270000"));
  EXPECT_THAT(talk.ask("612#4014610100000000"), ElementsAre("592#43146101E8030000"));  // 1000 us
  EXPECT_FLOAT_EQ(real(0x6148, 3), -2000);
  EXPECT_FLOAT_EQ(real(0x6149, 6), 25);
}

struct NoisyForceTorqueNodeTest : ForceTorqueNodeTest {
  NoisyForceTorqueNodeTest() { noisy_talk.listen(milliseconds(2)); }
  static ForceTorqueParameters noisy_parameters() {
    ForceTorqueParameters p;
    p.node_id = 18;
    p.name = "RWrist FT";
    p.serial = 18;
    p.transducer.noise << 0.25, 0.25, 0.25, 0.005, 0.005, 0.004;
    p.transducer.bias << 1.3, -0.7, 0, 0.021, 0, 0;
    p.transducer.noise_seed = 5;
    return p;
  }
  ForceTorqueNode noisy{noisy_parameters()};
  Conversation noisy_talk{noisy};
};

TEST_F(NoisyForceTorqueNodeTest, NoiseAndBiasAverageToLoadAndBias) {
  constexpr int kSamples = 4000;
  double sum = 0;
  double squares = 0;
  noisy_talk.ask("000#0112");
  for (int i = 0; i < kSamples; ++i) {
    Wrench load;
    load.force = {10, 0, 0};
    noisy.sample(load);
    const std::string frame = noisy_talk.ask("080#").at(0);  // "192#LLHH...": Fx in 0.1 N
    const auto raw =
        static_cast<std::int16_t>(std::stoul(frame.substr(6, 2) + frame.substr(4, 2), nullptr, 16));
    sum += 0.1 * raw;
    squares += 0.01 * raw * raw;
  }
  const double mean = sum / kSamples;
  // Far finer than the lattice of 0.25 N, since noise of one resolution dithers it. Every second step of that
  // lattice lies half-way between steps of 0.1 N and is rounded away from zero by 0.05 N.
  EXPECT_NEAR(mean, 11.3 + 0.025, 0.02);
  const double lattice = 0.25 * 0.25 / 12 + 0.1 * 0.1 / 12;  // variance that rounding adds
  EXPECT_NEAR(std::sqrt(squares / kSamples - mean * mean), std::sqrt(0.25 * 0.25 + lattice), 0.02);
}

TEST_F(NoisyForceTorqueNodeTest, SameSeedGivesTheSameReadings) {
  ForceTorqueNode twin(noisy_parameters());
  Conversation twin_talk{twin};
  twin_talk.listen(milliseconds(2));
  noisy_talk.ask("000#0112");
  twin_talk.ask("000#0112");
  for (int i = 0; i < 50; ++i) {
    noisy.sample({});
    twin.sample({});
    EXPECT_EQ(noisy_talk.ask("080#"), twin_talk.ask("080#"));
  }
}

}  // namespace
}  // namespace walkman::nodes
