// Error frames, error counters and the resulting states. Times are counted by hand from ISO 11898-1, in bits
// at 1 Mbit/s, i.e. in microseconds.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/bus/can_bus.h"
#include "emulator/bus/frame_length.h"
#include "tests/unit/bus/talker.h"

namespace walkman::bus {
namespace {

using can::LinkState;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::Pair;

struct FaultTest : testing::Test {
  FaultTest() {
    bus.attach(a);
    bus.attach(b);
  }
  /// Applies `verdict` to the first `n` attempts.
  void first(int n, FrameFate verdict) {
    left = n;
    bus.set_fault_port(
        [this, verdict](const can::Frame&, Time) { return left-- > 0 ? verdict : FrameFate::deliver(); });
  }
  ErrorCounters of(const Participant& participant) { return bus.error_counters(participant); }

  CanBus bus{"rarm", "can_rarm"};
  Talker a, b;
  int left = 0;
};

// 080# has 51 bits; its ACK slot is the 40th. An attempt without an acknowledgement: 40 bits, 6 of flag, 8 of
// delimiter, 3 of intermission.
constexpr int kToAckSlot = 40;
constexpr int kLoneAttempt = 40 + 6 + 8 + 3;

TEST(LoneNode, ClimbsToErrorPassiveAndStaysThere) {
  CanBus bus("x", "can_x");
  ComputerPort& end = bus.computer_port();
  end.configure({ErrorReports::kStates, {}, false});
  ASSERT_EQ(end.send({0x080, {}}), can::SendResult::kQueued);
  bus.advance(milliseconds(1));
  EXPECT_EQ(end.link(), LinkState::kPassive);
  EXPECT_EQ(bus.error_counters(end).transmit, 128);
  // 16 attempts; then each waits 8 more bits: the next ones start at 920 and 985.
  EXPECT_EQ(bus.counters().error_frames, 17U);
  EXPECT_EQ(bus.counters().busy_bits, 17U * kLoneAttempt);
  EXPECT_EQ(bus.counters().frames, 0U);

  can::StampedFrame report;
  ASSERT_TRUE(end.receive(report));
  EXPECT_EQ(report.time, microseconds(11 * kLoneAttempt + kToAckSlot));  // TEC 96
  can::Frame expected(0x004, {0, 0x08, 0, 0, 0, 0, 96, 0});
  expected.error = true;
  EXPECT_EQ(report.frame, expected);
  ASSERT_TRUE(end.receive(report));
  EXPECT_EQ(report.time, microseconds(15 * kLoneAttempt + kToAckSlot));  // TEC 128
  expected = can::Frame(0x004, {0, 0x20, 0, 0, 0, 0, 128, 0});
  expected.error = true;
  EXPECT_EQ(report.frame, expected);
  EXPECT_FALSE(end.receive(report));

  bus.advance(std::chrono::seconds(1));
  EXPECT_EQ(bus.error_counters(end).transmit, 128);
  EXPECT_EQ(end.link(), LinkState::kPassive);
  // With a node that acknowledges, the frame gets through at once, and at TEC 127 the sender is error-active
  // again.
  Talker other;
  bus.attach(other);
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_THAT(other.heard_ids(), ElementsAre(0x080));
  EXPECT_EQ(bus.error_counters(end).transmit, 127);
  EXPECT_EQ(end.link(), LinkState::kWarning);
}

TEST(LoneNode, TimeGoesOnWithTimingOff) {
  CanBus bus("x", "can_x", {.timing = false});
  ASSERT_EQ(bus.computer_port().send({0x080, {}}), can::SendResult::kQueued);
  bus.advance(milliseconds(1));
  EXPECT_EQ(bus.counters().error_frames, 17U);
  Talker other;
  bus.attach(other);
  bus.advance(milliseconds(2));
  ASSERT_EQ(other.heard.size(), 1U);
  ASSERT_EQ(bus.computer_port().send({0x081, {}}), can::SendResult::kQueued);
  bus.advance(milliseconds(2) + microseconds(8));
  ASSERT_EQ(other.heard.size(), 2U);
}

TEST(TimingOff, FramesKeepTheirOrderAndTwoThatAnswerEachOtherDoNotHoldTheClock) {
  CanBus bus("x", "can_x", {.timing = false});
  struct Echo : Talker {
    void receive(const can::Frame& frame, Time now) noexcept override {
      Talker::receive(frame, now);
      if (frame.id != answer) say({answer, {}});
    }
    std::uint32_t answer = 0;
  };
  Echo p, q;
  p.answer = 0x301;
  q.answer = 0x302;
  bus.attach(p);
  bus.attach(q);
  Talker listener;
  bus.attach(listener);
  listener.say({0x300, {}});
  listener.say({0x100, {}});
  bus.advance(microseconds(200));
  EXPECT_GT(listener.heard.size(), 8'000U);
  // Once the 8192 frames are through, a frame takes 47 to 55 us.
  EXPECT_LT(listener.heard.size(), 5 * 8200U);
  EXPECT_EQ(p.heard.at(0).frame.id, 0x300U);
  EXPECT_EQ(p.heard.at(0).time, Time{});
}

TEST_F(FaultTest, ABitErrorEndsTheFrameInAnErrorFrameAndItIsSentAgain) {
  // 555h: SOF 0, then 1 0 1 0. Inverting bit 1 makes two dominant bits, so that the receivers see their sixth
  // one after four bits of the flag: 6 + 4 bits of flags. Bit 2 inverted is recessive: 6 + 6.
  const can::Frame frame(0x555, {});
  const int length = frame_bits(frame) - kIntermissionBits;
  Time expected{};
  for (const auto& [bit, flags] : {std::pair(1, 10), std::pair(2, 12), std::pair(3, 10)}) {
    first(1, FrameFate::corrupt(bit));
    expected = bus.now() + microseconds(bit + 1 + flags + 8 + 3 + length);
    a.say(frame);
    bus.advance(bus.now() + milliseconds(1));
    ASSERT_FALSE(b.heard.empty());
    EXPECT_EQ(b.heard.back().time, expected) << "bit " << bit;
  }
  EXPECT_EQ(b.heard.size(), 3U);
  EXPECT_EQ(a.taken, 3);
  EXPECT_EQ(bus.counters().error_frames, 3U);
  EXPECT_EQ(bus.counters().frames, 3U);
}

TEST_F(FaultTest, AnErrorFrameHas17To23Bits) {
  const can::Frame frame(0x185, {0x37, 0x06, 0xE8, 0x03});
  const int length = frame_bits(frame) - kIntermissionBits;
  for (int bit = 0; bit < length; ++bit) {
    CanBus wire("x", "can_x");
    Talker sender;
    wire.attach(sender);
    int attempts = 0;
    wire.set_fault_port([&](const can::Frame&, Time) {
      return attempts++ == 0 ? FrameFate::corrupt(bit) : FrameFate::deliver();
    });
    sender.say(frame);
    wire.advance(milliseconds(1));
    EXPECT_EQ(attempts, 2) << bit;
    const int extra = static_cast<int>(wire.counters().busy_bits) - (length + kIntermissionBits) - (bit + 1);
    EXPECT_GE(extra, 17) << bit;
    EXPECT_LE(extra, 23) << bit;
    EXPECT_EQ(wire.error_counters(sender).transmit, 7);
    EXPECT_EQ(wire.error_counters(wire.computer_port()).receive, 0);
  }
}

TEST_F(FaultTest, CountersFollowTheStandard) {
  a.say({0x123, {1}});
  first(1, FrameFate::corrupt(15));
  bus.advance(microseconds(50));  // the error is over, the retransmission is not
  EXPECT_EQ(of(a).transmit, 8);
  EXPECT_EQ(of(b).receive, 1);
  bus.advance(milliseconds(1));
  EXPECT_EQ(of(a).transmit, 7);
  EXPECT_EQ(of(b).receive, 0);

  // An error seen by one receiver only: its flag comes first, followed by a dominant bit.
  a.say({0x123, {1}});
  first(1, FrameFate::corrupt(15, &b));
  bus.advance(bus.now() + microseconds(50));
  EXPECT_EQ(of(a).transmit, 15);
  EXPECT_EQ(of(b).receive, 9);
  EXPECT_EQ(of(bus.computer_port()).receive, 1);
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_EQ(of(a).transmit, 14);
  EXPECT_EQ(of(b).receive, 8);
  EXPECT_EQ(of(bus.computer_port()).receive, 0);
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x123, 0x123));
}

TEST_F(FaultTest, AnErrorPassiveReceiverMissesAFrameAndDoesNotDestroyIt) {
  a.say({0x123, {1}});
  a.say({0x124, {1}});
  first(16, FrameFate::corrupt(15, &b));
  bus.advance(milliseconds(2));
  // After 15 errors `b` has REC 135. It cannot stop the sixteenth attempt, which succeeds without it.
  EXPECT_EQ(bus.counters().error_frames, 15U);
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x124));
  can::StampedFrame frame;
  ASSERT_TRUE(bus.computer_port().receive(frame));
  EXPECT_EQ(frame.frame.id, 0x123U);
  // Its REC was above 127 and is set to the lowest value that the standard allows.
  EXPECT_EQ(of(b).receive, 119);
  EXPECT_EQ(of(b).state, LinkState::kWarning);
  EXPECT_EQ(of(a).transmit, 15 * 8 - 2);
}

TEST_F(FaultTest, BusOffAt256AndBackAfter1408Bits) {
  bus.set_fault_port([](const can::Frame& frame, Time) {
    return frame.id == 0x555 ? FrameFate::corrupt(1) : FrameFate::deliver();
  });
  a.say({0x555, {}});
  bus.advance(milliseconds(10));
  // Active: 2 bits, 10 of flags and 11 more = 23 per attempt. Passive: a recessive flag after a dominant bit
  // is seen after six bits: 2 + 12 + 11, plus 8 of suspend transmission.
  EXPECT_THAT(a.states, ElementsAre(Pair(LinkState::kWarning, microseconds(11 * 23 + 2)),
                                    Pair(LinkState::kPassive, microseconds(15 * 23 + 2)),
                                    Pair(LinkState::kBusOff, microseconds(16 * 23 + 8 + 15 * 33 + 2)),
                                    Pair(LinkState::kActive, microseconds(873 + 12 + 1408))));
  EXPECT_EQ(bus.counters().error_frames, 32U);
  EXPECT_EQ(bus.counters().given_up, 1U);
  EXPECT_EQ(of(a).transmit, 0);
  EXPECT_TRUE(b.heard.empty());
  EXPECT_EQ(of(b).receive, 32);

  b.say({0x700, {}});
  a.say({0x100, {}});
  bus.advance(milliseconds(20));
  EXPECT_THAT(a.heard_ids(), ElementsAre(0x700));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x100));
}

TEST_F(FaultTest, OnABusyBusEveryFrameIsOneOfThe128) {
  bus.set_fault_port([](const can::Frame& frame, Time) {
    return frame.id == 0x555 ? FrameFate::corrupt(1) : FrameFate::deliver();
  });
  a.say({0x555, {}});
  bus.advance(microseconds(885));  // bus-off at 873, error delimiter from 885 on
  for (int i = 0; i < 200; ++i) b.say({0x080, {}});
  bus.advance(milliseconds(20));
  // One run of recessive bits in the error delimiter and intermission, then 127 frames of 51 bits.
  ASSERT_EQ(a.states.size(), 4U);
  EXPECT_EQ(a.states.back(), std::pair(LinkState::kActive, Time(microseconds(885 + 11 + 127 * 51))));
  // From then on it receives the frames.
  EXPECT_EQ(a.heard.size(), 200U - 127U);
}

TEST_F(FaultTest, OneThatDoesNotRestartStaysOff) {
  a.comes_back = false;
  first(32, FrameFate::corrupt(1));
  a.say({0x555, {}});
  a.say({0x556, {}});
  bus.advance(milliseconds(100));
  EXPECT_EQ(of(a).state, LinkState::kBusOff);
  EXPECT_TRUE(b.heard.empty());
  b.say({0x100, {}});
  bus.advance(milliseconds(101));
  EXPECT_TRUE(a.heard.empty());
  a.comes_back = true;
  bus.advance(milliseconds(101) + microseconds(1407));
  EXPECT_EQ(of(a).state, LinkState::kBusOff);
  bus.advance(milliseconds(101) + microseconds(1408));
  EXPECT_EQ(of(a).state, LinkState::kActive);
  bus.advance(milliseconds(103));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x556));
}

TEST_F(FaultTest, AnErrorPassiveSenderLetsOthersGoFirst) {
  const auto order = [](int errors) {
    CanBus wire("x", "can_x");
    Talker p, q, listener;
    wire.attach(p);
    wire.attach(q);
    wire.attach(listener);
    int count = 0;
    wire.set_fault_port([&](const can::Frame&, Time) {
      return count++ < errors ? FrameFate::corrupt(1) : FrameFate::deliver();
    });
    p.say({0x555, {}});
    wire.advance(milliseconds(1));
    listener.heard.clear();
    p.say({0x101, {}});
    p.say({0x102, {}});
    wire.advance(wire.now() + microseconds(10));
    q.say({0x700, {}});
    wire.advance(wire.now() + milliseconds(1));
    return listener.heard_ids();
  };
  EXPECT_THAT(order(0), ElementsAre(0x101, 0x102, 0x700));
  EXPECT_THAT(order(20), ElementsAre(0x101, 0x700, 0x102));
}

TEST_F(FaultTest, AMissingAcknowledgementIsAnError) {
  a.say({0x080, {}});
  first(1, FrameFate::no_acknowledge());
  bus.advance(milliseconds(1));
  // The receivers see a form error in the ACK delimiter: their flags come one bit later.
  ASSERT_EQ(b.heard.size(), 1U);
  EXPECT_EQ(b.heard[0].time, microseconds(kToAckSlot + 7 + 8 + 3 + 48));
  EXPECT_EQ(of(a).transmit, 7);
}

TEST_F(FaultTest, AnErrorPassiveSenderWithoutAcknowledgementRepeatsWhatWasReceived) {
  first(17, FrameFate::no_acknowledge());
  a.say({0x080, {}});
  bus.advance(milliseconds(5));
  // Sixteen attempts are destroyed; nobody sees the recessive flag of the next one, and TEC does not rise.
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x080, 0x080));
  EXPECT_EQ(of(a).transmit, 127);
  EXPECT_EQ(bus.counters().frames, 1U);
  EXPECT_EQ(bus.counters().error_frames, 17U);
}

TEST_F(FaultTest, AnErrorInTheLastBitOfAFrameDoublesIt) {
  first(1, FrameFate::corrupt(1000));
  a.say({0x080, {}});
  bus.advance(milliseconds(1));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x080, 0x080));
  EXPECT_EQ(of(b).receive, 0);
  EXPECT_EQ(of(a).transmit, 7);
}

TEST_F(FaultTest, OneShotIsNotSentAgain) {
  a.sends_once = true;
  first(1, FrameFate::corrupt(20));
  a.say({0x100, {}});
  a.say({0x101, {}});
  bus.advance(milliseconds(1));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x101));
  EXPECT_EQ(bus.counters().given_up, 1U);
}

TEST_F(FaultTest, ALostFrameDisturbsNobody) {
  first(1, FrameFate::lose());
  a.say({0x080, {}});
  a.say({0x081, {}});
  bus.advance(milliseconds(1));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x081));
  EXPECT_EQ(bus.counters().lost, 1U);
  EXPECT_EQ(bus.counters().frames, 2U);
  EXPECT_EQ(of(a).transmit, 0);
}

TEST_F(FaultTest, EqualFramesMerge) {
  Talker c;
  bus.attach(c);
  a.say({0x080, {1}});
  b.say({0x080, {1}});
  b.say({0x081, {}});
  bus.advance(milliseconds(1));
  EXPECT_THAT(c.heard_ids(), ElementsAre(0x080, 0x081));
  EXPECT_THAT(a.heard_ids(), ElementsAre(0x081));
  EXPECT_TRUE(b.heard.empty());
  EXPECT_EQ(bus.counters().frames, 2U);
  EXPECT_EQ(bus.counters().error_frames, 0U);
}

TEST_F(FaultTest, DifferentFramesOfOneIdentifierCollideUntilOneIsErrorPassive) {
  Talker c;
  bus.attach(c);
  a.say({0x100, {0x0F}});
  b.say({0x100, {0x8F}});
  bus.advance(microseconds(500));
  EXPECT_TRUE(c.heard.empty());
  EXPECT_GT(of(a).transmit, 0);
  EXPECT_EQ(of(a).transmit, of(b).transmit);
  bus.advance(milliseconds(5));
  // After sixteen rounds both are error-passive: the flag of the recessive sender no longer stops anything.
  EXPECT_EQ(bus.counters().error_frames, 16U);
  ASSERT_EQ(c.heard.size(), 2U);
  EXPECT_EQ(c.heard[0].frame.data[0], 0x0F);
  EXPECT_EQ(c.heard[1].frame.data[0], 0x8F);
  EXPECT_THAT(a.heard_ids(), ElementsAre(0x100));
  EXPECT_TRUE(b.heard.empty());
  EXPECT_EQ(of(a).transmit, 127);
  EXPECT_EQ(of(b).transmit, 128 + 8 - 1);
  EXPECT_EQ(of(c).receive, 16 - 2);
  EXPECT_EQ(of(b).state, LinkState::kPassive);
}

TEST_F(FaultTest, ACollisionEndsWhereTheFramesDiffer) {
  // 100h with one byte: SOF 0, 001 0000 0000, 000, DLC 0001. Stuff bits after 00000 (id), after 00000 again
  // (id, RTR, IDE, r0, DLC start): the first data bit is number 19 + 2 = 21.
  a.say({0x100, {0x0F}});
  b.say({0x100, {0x8F}});
  bus.advance(milliseconds(5));
  // Up to bit 21. The DLC ended in 1, so that one dominant bit precedes the flag: 22 + 11 + 8 + 3 per round.
  // The sixteenth round is followed by 8 bits of suspend transmission.
  ASSERT_FALSE(a.heard.empty());
  const int length = frame_bits({0x100, {0x0F}});
  const int second = frame_bits({0x100, {0x8F}});
  EXPECT_EQ(a.heard[0].time, microseconds(16 * (22 + 11 + 8 + 3) + 8 + length + 8 + second - 3));
}

TEST_F(FaultTest, DataAndRemoteFramesOfOneIdentifierArbitrate) {
  can::Frame remote(0x705, {});
  remote.remote = true;
  a.say(remote);
  b.say({0x705, {5}});
  bus.advance(milliseconds(1));
  EXPECT_EQ(bus.counters().error_frames, 0U);
  ASSERT_EQ(a.heard.size(), 1U);
  ASSERT_EQ(b.heard.size(), 1U);
  EXPECT_LT(a.heard[0].time, b.heard[0].time);
}

TEST_F(FaultTest, ACutCableLeavesTheRestOfTheBusAlone) {
  bus.cut(a);
  a.say({0x100, {}});
  b.say({0x200, {}});
  bus.advance(milliseconds(5));
  EXPECT_TRUE(a.heard.empty());
  EXPECT_EQ(bus.counters().error_frames, 0U);
  EXPECT_EQ(bus.counters().frames, 1U);
  // It keeps retransmitting to nobody.
  EXPECT_EQ(of(a).state, LinkState::kPassive);
  EXPECT_EQ(of(a).transmit, 128);
  bus.reconnect(a);
  bus.advance(milliseconds(6));
  EXPECT_THAT(b.heard_ids(), ElementsAre(0x100));
  b.say({0x201, {}});
  bus.advance(milliseconds(7));
  EXPECT_THAT(a.heard_ids(), ElementsAre(0x201));
}

TEST_F(FaultTest, CuttingTheOnlyOtherLeavesALoneNode) {
  CanBus pair("x", "can_x");
  Talker p;
  pair.attach(p);
  pair.cut(p);
  ASSERT_EQ(pair.computer_port().send({0x080, {}}), can::SendResult::kQueued);
  pair.advance(milliseconds(10));
  EXPECT_EQ(pair.computer_port().link(), LinkState::kPassive);
  EXPECT_FALSE(pair.quiet());
  pair.reconnect(p);
  pair.advance(milliseconds(11));
  EXPECT_THAT(p.heard_ids(), ElementsAre(0x080));
  EXPECT_TRUE(pair.quiet());
}

TEST_F(FaultTest, StepsDoNotChangeWhatHappensUnderFaults) {
  const auto run = [](Time step) {
    CanBus wire("x", "can_x", {.bit_rate = 500'000});
    Talker p, q, r;
    for (Talker* talker : {&p, &q, &r}) wire.attach(*talker);
    std::vector<std::pair<Time, std::uint32_t>> log;
    wire.set_observer([&](const can::StampedFrame& f) { log.emplace_back(f.time, f.frame.id); });
    int attempt = 0;
    wire.set_fault_port([&](const can::Frame&, Time) {
      ++attempt;
      if (attempt % 3 == 1) return FrameFate::corrupt(attempt % 60);
      if (attempt % 7 == 2) return FrameFate::corrupt(attempt % 50, &q);
      if (attempt % 11 == 3) return FrameFate::no_acknowledge();
      return FrameFate::deliver();
    });
    for (std::uint8_t i = 0; i < 40; ++i) {
      p.say({0x200U + i, {1, 2}});
      q.say({0x200U + i, {i, 2}});
      r.say({0x180U + i, {i}});
    }
    for (Time t{}; t < milliseconds(60);) wire.advance(t += step);
    return log;
  };
  const auto coarse = run(milliseconds(60));
  EXPECT_GT(coarse.size(), 60U);
  EXPECT_EQ(coarse, run(microseconds(7)));
  EXPECT_EQ(coarse, run(microseconds(250)));
}

}  // namespace
}  // namespace walkman::bus
