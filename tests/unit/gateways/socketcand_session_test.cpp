#include "emulator/gateways/socketcand_session.h"

#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace walkman::gateways {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Step = SocketcandSession::Step;
using testing::StartsWith;

/// A client of two buses, on which the computer's end is the peer.
class SocketcandSessionTest : public testing::Test {
 protected:
  /// What the session writes in reply to `input`, up to where it stops.
  std::string say(SocketcandSession& session, std::string_view input) {
    std::string replies;
    for (;;) {
      last_ = session.step(input, wall_);
      replies += drained(session);
      if (last_ != Step::kDone) return replies;
    }
  }
  static std::string drained(SocketcandSession& session) {
    std::string text(session.outgoing().text());
    session.outgoing().pop(text.size());
    return text;
  }
  std::string forwarded(SocketcandSession& session) {
    rarm_.advance(rarm_.now() + milliseconds(1));
    session.forward(wall_);
    return drained(session);
  }
  void enter_rawmode(SocketcandSession& session) {
    EXPECT_EQ(say(session, "< open can_rarm >< rawmode >"), "< hi >< ok >< ok >");
    EXPECT_EQ(say(session, "< echo >"), "< echo >");  // ends the pause
    session.forward(wall_);
  }
  void peer_sends(const can::Frame& frame) {
    ASSERT_EQ(rarm_.computer_port().send(frame), can::SendResult::kQueued);
  }

  bus::CanBus rarm_{"rarm", "can_rarm"};
  bus::CanBus torso_{"torso", "can_torso"};
  std::array<bus::CanBus*, 2> buses_{&rarm_, &torso_};
  EndPool pool_{buses_};
  SocketcandCounters counters_;
  Time wall_ = seconds(1000);
  Step last_ = Step::kDone;
};

TEST_F(SocketcandSessionTest, HandshakeByInterfaceOrLimbName) {
  SocketcandSession session(pool_, counters_);
  EXPECT_EQ(drained(session), "< hi >");
  EXPECT_EQ(say(session, "< rawmode >"), "< error no bus open >");
  EXPECT_EQ(say(session, "< open vcan0 >"), "< error could not open bus >");
  EXPECT_EQ(say(session, "< open can_torso >"), "< ok >");
  EXPECT_EQ(say(session, "< open can_rarm >"), "< error bus already open >");
  EXPECT_EQ(say(session, "< rawmode >"), "< ok >");
  EXPECT_EQ(say(session, "< echo >"), "< echo >");
  EXPECT_EQ(say(session, "< bcmmode >"), "< error unknown command >");
  EXPECT_EQ(say(session, "< send 80 >"), "< error syntax error >");
  EXPECT_EQ(say(session, "< rawmode >"), "< ok >");
  SocketcandSession other(pool_, counters_);
  EXPECT_EQ(say(other, "< open rarm >"), "< hi >< ok >");
  EXPECT_EQ(counters_.errors, 5U);
}

TEST_F(SocketcandSessionTest, FramesGoBothWaysAndAreNotEchoed) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  EXPECT_EQ(say(session, "< send 60B 8 40 0 10 0 0 0 0 0 >"), "");
  EXPECT_EQ(forwarded(session), "");
  can::StampedFrame received;
  ASSERT_TRUE(rarm_.computer_port().receive(received));
  EXPECT_EQ(received.frame, can::Frame(0x60B, {0x40, 0, 0x10, 0, 0, 0, 0, 0}));

  peer_sends({0x58B, {0x43, 0, 0x10, 0, 0x92, 1, 2, 0}});
  const Time before = rarm_.now();
  const std::string text = forwarded(session);
  EXPECT_THAT(text, StartsWith("< frame 58B 0.0"));
  EXPECT_THAT(text, testing::EndsWith(" 4300100092010200 >"));
  // The time is the bus's: the frame was on the wire for 111..135 bits of 1 us.
  const double s = std::stod(text.substr(text.find("58B") + 4));
  EXPECT_NEAR(s, std::chrono::duration<double>(before).count() + 118e-6, 20e-6);
  EXPECT_EQ(counters_.sent, 1U);
  EXPECT_EQ(counters_.received, 1U);
}

TEST_F(SocketcandSessionTest, NothingOfABusReachesAClientBeforeRawmode) {
  SocketcandSession session(pool_, counters_);
  EXPECT_EQ(say(session, "< open rarm >"), "< hi >< ok >");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< send 80 0  >"), "");
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(counters_.sent, 1U);
}

TEST_F(SocketcandSessionTest, TheReplyToRawmodeStandsAlone) {
  SocketcandSession session(pool_, counters_);
  EXPECT_EQ(say(session, "< open rarm >< rawmode >"), "< hi >< ok >< ok >");
  peer_sends({0x701, {5}});
  for (int ms = 0; ms < 250; ++ms) {
    EXPECT_EQ(forwarded(session), "");
    EXPECT_GT(session.held_until(), wall_);
    EXPECT_LE(session.held_until(), wall_ + milliseconds(50));
    wall_ += milliseconds(1);
  }
  EXPECT_THAT(forwarded(session), StartsWith("< frame 701 "));
  EXPECT_EQ(session.held_until(), Time::min());
}

TEST_F(SocketcandSessionTest, AMachineThatStoodStillHasGivenNobodyTimeToRead) {
  SocketcandSession session(pool_, counters_);
  EXPECT_EQ(say(session, "< open rarm >< rawmode >"), "< hi >< ok >< ok >");
  peer_sends({0x701, {5}});
  wall_ += seconds(10);
  EXPECT_EQ(forwarded(session), "");
  wall_ += milliseconds(100);
  EXPECT_EQ(forwarded(session), "");
}

TEST_F(SocketcandSessionTest, WhoSpeaksHasReadTheReply) {
  SocketcandSession session(pool_, counters_);
  EXPECT_EQ(say(session, "< open rarm >< rawmode >"), "< hi >< ok >< ok >");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< send 80 0  >"), "");
  EXPECT_THAT(forwarded(session), StartsWith("< frame 701 "));
}

/// What python-can 4.1.0 does with what it receives (can/interfaces/socketcand: 1024 characters at a time,
/// and of what is left after the last whole message, the first character is dropped).
int frames_python_can_reads(std::string_view stream) {
  std::string buffer;
  int frames = 0;
  while (!stream.empty()) {
    buffer += stream.substr(0, 1024);
    stream.remove_prefix(std::min<std::size_t>(stream.size(), 1024));
    std::size_t processed = 0;
    for (std::string_view view = buffer;;) {
      const auto start = view.find('<');
      const auto end = view.find('>');
      if (start == std::string_view::npos || end == std::string_view::npos) break;
      processed += end + 1;
      if (start < end && view.substr(start, 8) == "< frame ") ++frames;
      view.remove_prefix(end + 1);
    }
    buffer.erase(0, processed + 1);
  }
  return frames;
}

TEST_F(SocketcandSessionTest, ABurstIsReadWholeByPythonCan) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  for (std::uint32_t i = 0; i < 200; ++i) peer_sends({0x180 + i % 100, std::vector<std::uint8_t>(i % 9)});
  rarm_.advance(rarm_.now() + milliseconds(50));
  session.forward(wall_);
  const std::string text = drained(session);
  ASSERT_GT(text.size(), 6'000U);
  EXPECT_EQ(frames_python_can_reads(text), 200);
  // Without the line feeds the reader would lose some: what the separation is for.
  std::string bare = text;
  std::erase(bare, '\n');
  EXPECT_LT(frames_python_can_reads(bare), 200);
  EXPECT_EQ(text.substr(0, 1000).find('\n'), std::string::npos);
}

TEST_F(SocketcandSessionTest, ASlowClientLosesFramesButNotReplies) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  for (int i = 0; i < 3'000; ++i) peer_sends({0x181, {1, 2, 3, 4, 5, 6, 7, 8}});
  rarm_.advance(rarm_.now() + seconds(1));
  session.forward(wall_);
  EXPECT_GT(counters_.dropped, 1'000U);
  EXPECT_EQ(counters_.received + counters_.dropped, 3'000U);
  std::string_view echo = "< echo >";
  EXPECT_EQ(session.step(echo, wall_), Step::kDone);
  EXPECT_THAT(drained(session), testing::EndsWith(" >< echo >"));
  // Frames are dropped whole, and the next one arrives.
  peer_sends({0x182, {}});
  EXPECT_THAT(forwarded(session), testing::HasSubstr("< frame 182 "));
}

TEST_F(SocketcandSessionTest, AClientThatReadsNothingIsReadNoMore) {
  SocketcandSession session(pool_, counters_);
  std::string flood;
  for (int i = 0; i < 10'000; ++i) flood += "< echo >";
  std::string_view input = flood;
  Step step = Step::kDone;
  while (step == Step::kDone) step = session.step(input, wall_);
  EXPECT_EQ(step, Step::kBlocked);
  const std::size_t left = input.size();
  EXPECT_GT(left, 0U);
  EXPECT_EQ(session.step(input, wall_), Step::kBlocked);
  EXPECT_EQ(input.size(), left);
  std::string replies = drained(session);
  for (step = Step::kDone; step != Step::kNeedMore;) {
    step = session.step(input, wall_);
    replies += drained(session);
  }
  EXPECT_EQ(replies, "< hi >" + flood);
}

TEST_F(SocketcandSessionTest, AFloodWaitsForTheBusAndLosesNothing) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  std::string flood;
  for (int i = 0; i < 5'000; ++i) flood += "< send 7F0 1 " + std::to_string(i % 10) + " >";
  std::string_view input = flood;
  int received = 0;
  int blocked = 0;
  for (int ms = 0; ms < 2'000; ++ms) {
    Step step = Step::kDone;
    while (step == Step::kDone) step = session.step(input, wall_);
    if (step == Step::kBlocked) ++blocked;
    rarm_.advance(rarm_.now() + milliseconds(1));
    can::StampedFrame frame;
    while (rarm_.computer_port().receive(frame)) {
      ASSERT_EQ(frame.frame.data[0], received % 10);
      ++received;
    }
  }
  EXPECT_GT(blocked, 0);
  EXPECT_EQ(received, 5'000);
  EXPECT_EQ(counters_.sent, 5'000U);
}

TEST_F(SocketcandSessionTest, FramesWithoutAMessageAreCounted) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  can::Frame remote(0x705, {});
  remote.remote = true;
  peer_sends(remote);
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(counters_.skipped, 1U);
}

TEST_F(SocketcandSessionTest, BusOffIsToldAndOver) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  rarm_.set_fault_port([](const can::Frame&, Time) { return bus::FrameFate::corrupt(1); });
  say(session, "< send 555 0 >");
  const std::string reports = forwarded(session);
  rarm_.set_fault_port(nullptr);
  // Warning, passive, bus-off after 32 attempts.
  EXPECT_THAT(reports,
              testing::MatchesRegex("< error 004 [0-9.]+ >< error 004 [0-9.]+ >< error 040 [0-9.]+ >"));
  say(session, "< send 123 0 >");
  EXPECT_EQ(counters_.refused, 1U);
  rarm_.advance(rarm_.now() + milliseconds(110));
  EXPECT_THAT(forwarded(session), StartsWith("< error 100 "));
  say(session, "< send 123 0 >");
  rarm_.advance(rarm_.now() + milliseconds(1));
  can::StampedFrame frame;
  ASSERT_TRUE(rarm_.computer_port().receive(frame));
  EXPECT_EQ(frame.frame.id, 0x123U);
}

TEST_F(SocketcandSessionTest, FdFramesAreCountedOnly) {
  bus::CanBus fast("fast", "can_fast", {.fd = true});
  std::array<bus::CanBus*, 1> buses{&fast};
  EndPool pool(buses);
  SocketcandSession session(pool, counters_);
  EXPECT_EQ(say(session, "< open fast >< rawmode >< echo >"), "< hi >< ok >< ok >< echo >");
  can::Frame frame(0x181, std::vector<std::uint8_t>(48));
  frame.fd = true;
  ASSERT_EQ(fast.computer_port().send(frame), can::SendResult::kQueued);
  ASSERT_EQ(fast.computer_port().send({0x182, {1}}), can::SendResult::kQueued);
  fast.advance(milliseconds(1));
  session.forward(wall_);
  EXPECT_THAT(drained(session), StartsWith("< frame 182 "));
  EXPECT_EQ(counters_.skipped, 1U);
}

TEST_F(SocketcandSessionTest, AMessageWithoutAnEndClosesTheConnection) {
  SocketcandSession session(pool_, counters_);
  enter_rawmode(session);
  EXPECT_EQ(say(session, "< send " + std::string(1'000'000, '1')), "< error message too long >");
  EXPECT_EQ(last_, Step::kClosed);
}

TEST_F(SocketcandSessionTest, EndsAreUsedAgain) {
  for (int i = 0; i < 50; ++i) {
    SocketcandSession one(pool_, counters_);
    SocketcandSession two(pool_, counters_);
    enter_rawmode(one);
    enter_rawmode(two);
    // Nothing an earlier client has left unread reaches the next.
    EXPECT_EQ(forwarded(one), "");
    EXPECT_EQ(forwarded(two), "");
    say(one, "< send 123 1 7 >");
    rarm_.advance(rarm_.now() + milliseconds(1));
    two.forward(wall_);
    EXPECT_THAT(drained(two), StartsWith("< frame 123 "));
    peer_sends({0x321, {}});
    rarm_.advance(rarm_.now() + milliseconds(1));
  }
  EXPECT_EQ(pool_.size(), 2U);
}

TEST_F(SocketcandSessionTest, AnyBytesAtAll) {
  std::mt19937 random(3);
  const std::string alphabet = "<><> 01f8";
  for (int run = 0; run < 300; ++run) {
    SocketcandSession session(pool_, counters_);
    enter_rawmode(session);
    std::string text;
    for (int i = 0; i < 300; ++i) {
      text +=
          random() % 8 == 0 ? std::string("< send 7") : std::string(1, alphabet[random() % alphabet.size()]);
      if (random() % 50 == 0) text += static_cast<char>(random());
    }
    say(session, text);
    EXPECT_TRUE(last_ == Step::kNeedMore || last_ == Step::kClosed);
    rarm_.advance(rarm_.now() + milliseconds(100));
    if (last_ == Step::kClosed) continue;
    say(session, ">");
    EXPECT_EQ(say(session, "< echo >"), "< echo >");
  }
  EXPECT_GT(counters_.errors, 1'000U);
}

}  // namespace
}  // namespace walkman::gateways
