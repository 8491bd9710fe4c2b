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

/// A client of two buses, with the computer port as the peer.
class SocketcandSessionTest : public testing::Test {
 protected:
  /// Returns what the session writes in reply to `input` until it stops.
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
  ControllerPool pool_{buses_};
  SocketcandCounters counters_;
  Time wall_ = seconds(1000);
  Step last_ = Step::kDone;
};

TEST_F(SocketcandSessionTest, HandshakeByInterfaceOrLimbName) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(drained(session), "< hi >");
  EXPECT_EQ(say(session, "< open can_torso >"), "< ok >");
  EXPECT_EQ(say(session, "< open can_rarm >"), "< error unknown command >");
  EXPECT_EQ(say(session, "< rawmode >"), "< ok >");
  EXPECT_EQ(say(session, "< echo >"), "< echo >");
  EXPECT_EQ(say(session, "< isotpmode >"), "< error unknown command >");
  EXPECT_EQ(say(session, "< send 80 >"), "< error syntax error >");
  EXPECT_EQ(say(session, "< rawmode >"), "< error unknown command >");
  SocketcandSession other(pool_, counters_, wall_);
  EXPECT_EQ(say(other, "< open rarm >"), "< hi >< ok >");
  EXPECT_EQ(counters_.errors, 4U);
}

TEST_F(SocketcandSessionTest, WhateverElseAClientBeginsWithEndsTheConnection) {
  const std::pair<const char*, const char*> beginnings[] = {
      {"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n< open rarm >< send 0 2 81 0 >", "< hi >"},
      {"POST / HTTP/1.1\r\n\r\n< open rarm >< rawmode >< send 0 2 81 0 >", "< hi >"},
      {"\x16\x03\x01< open rarm >", "< hi >"},
      {"< rawmode >< open rarm >", "< hi >< error unknown command >"},
      {"< echo >", "< hi >< error unknown command >"},
      {"< send 0 2 81 0 >", "< hi >< error unknown command >"},
      {"< open vcan0 >< open rarm >", "< hi >< error could not open bus >"},
      {"< open >", "< hi >< error unknown command >"},
  };
  for (const auto& [text, replies] : beginnings) {
    SocketcandSession session(pool_, counters_, wall_);
    EXPECT_EQ(say(session, text), replies);
    EXPECT_EQ(last_, Step::kClosed) << text;
  }
  rarm_.advance(rarm_.now() + milliseconds(10));
  EXPECT_EQ(counters_.sent, 0U);
  // Text outside a message ends it later on, too.
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "\n< open rarm >\r\n< echo > x< send 0 2 81 0 >"), "< hi >< ok >< echo >");
  EXPECT_EQ(last_, Step::kClosed);
  EXPECT_EQ(counters_.sent, 0U);
}

TEST_F(SocketcandSessionTest, WhoOpensNothingHasThirtySeconds) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(session.open_until(), wall_ + seconds(30));
  EXPECT_EQ(say(session, "< open rarm >"), "< hi >< ok >");
  EXPECT_EQ(session.open_until(), Time::max());
}

TEST_F(SocketcandSessionTest, InModeBcmOnlyWhatWasAskedForIsReceived) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >"), "< hi >< ok >");
  EXPECT_EQ(say(session, "< subscribe 0 0 181 >< subscribe 0 0 00000181 >"), "");
  for (const std::uint32_t id : {0x180U, 0x181U, 0x182U}) peer_sends({id, {0x11, 0x22}});
  can::Frame extended(0x181, {0x33});
  extended.extended = true;
  peer_sends(extended);
  EXPECT_THAT(forwarded(session),
              testing::MatchesRegex("< frame 181 [0-9.]+ 11 22  >< frame 00000181 [0-9.]+ 33  >"));
  EXPECT_EQ(say(session, "< unsubscribe 181 >"), "");
  peer_sends({0x181, {0x11, 0x22}});
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< rawmode >"), "< ok >");
  EXPECT_EQ(say(session, "< bcmmode >"), "< ok >");  // earlier subscriptions are forgotten
  peer_sends(extended);
  EXPECT_EQ(forwarded(session), "");
}

TEST_F(SocketcandSessionTest, AFilterPassesChangesUnderItsMask) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< filter 0 0 123 8 FF 00 F8 0 0 0 0 0 >"), "< hi >< ok >");
  const auto told = [&](std::uint8_t first, std::uint8_t second, std::uint8_t third) {
    peer_sends({0x123, {first, second, third}});
    return !forwarded(session).empty();
  };
  EXPECT_TRUE(told(0, 0, 0));  // the first one always passes
  EXPECT_FALSE(told(0, 0, 0));
  EXPECT_FALSE(told(0, 9, 0x07));  // outside the mask
  EXPECT_TRUE(told(0, 9, 0x08));
  EXPECT_TRUE(told(1, 9, 0x08));
  EXPECT_FALSE(told(1, 0, 0x0F));
}

TEST_F(SocketcandSessionTest, AMultiplexFilterKeepsTheMultiplexesApart) {
  SocketcandSession session(pool_, counters_, wall_);
  // The example of doc/protocol.md with two of its multiplexes.
  EXPECT_EQ(say(session,
                "< open rarm >< muxfilter 0 0 123 3 FF 00 00 00 00 00 00 00 33 FF FF FF FF FF FF FF "
                "56 FF 00 00 00 00 FF FF >"),
            "< hi >< ok >");
  const auto told = [&](std::uint8_t multiplex, std::uint8_t second, std::uint8_t third) {
    peer_sends({0x123, {multiplex, second, third, 0, 0, 0, 0, 0}});
    return !forwarded(session).empty();
  };
  EXPECT_TRUE(told(0x33, 1, 1));
  EXPECT_TRUE(told(0x56, 1, 1));
  EXPECT_FALSE(told(0x44, 1, 1));  // not requested
  EXPECT_FALSE(told(0x33, 1, 1));
  EXPECT_TRUE(told(0x33, 1, 2));
  EXPECT_FALSE(told(0x56, 1, 2));  // the third byte is outside its mask
  EXPECT_TRUE(told(0x56, 2, 2));
  EXPECT_EQ(say(session, "< muxfilter 0 0 123 1 FF 00 00 00 00 00 00 00 >"), "< error syntax error >");
  EXPECT_EQ(say(session, "< muxfilter 0 0 123 2 FF 00 00 00 00 00 00 00 33 >"), "< error syntax error >");
}

TEST_F(SocketcandSessionTest, AnIntervalKeepsTheNewestFrameBack) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< subscribe 0 10000 181 >"), "< hi >< ok >");
  std::vector<std::string> told;
  for (std::uint8_t ms = 0; ms < 30; ++ms) {
    peer_sends({0x181, {ms}});
    if (const std::string text = forwarded(session); !text.empty())
      told.push_back(text.substr(text.size() - 5, 2));
  }
  EXPECT_EQ(told, (std::vector<std::string>{"00", "0A", "14"}));
}

TEST_F(SocketcandSessionTest, AddedFramesAreSentAtTheirIntervals) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< add 0 20000 123 2 42 43 >< add 0 0 124 0 >"), "< hi >< ok >");
  const auto sent = [&](int ms) {
    std::vector<std::uint32_t> ids;
    can::StampedFrame frame;
    for (int i = 0; i < ms; ++i) {
      EXPECT_EQ(forwarded(session), "");
      while (rarm_.computer_port().receive(frame)) ids.push_back(frame.frame.id << 8 | frame.frame.data[0]);
    }
    return ids;
  };
  // At once, then every 20 ms; the other frame has no interval.
  EXPECT_EQ(sent(50), (std::vector<std::uint32_t>{0x12342, 0x12400, 0x12342, 0x12342}));
  EXPECT_EQ(say(session, "< update 123 1 7 >"), "");
  EXPECT_EQ(sent(20), (std::vector<std::uint32_t>{0x12307}));  // with unchanged timing
  EXPECT_EQ(say(session, "< delete 123 >"), "");
  EXPECT_TRUE(sent(50).empty());
  EXPECT_EQ(say(session, "< add 0 1000 125 0 >"), "");
  sent(1);
  EXPECT_EQ(say(session, "< rawmode >"), "< ok >");  // ends them all
  wall_ += seconds(1);
  sent(2);
  EXPECT_TRUE(sent(10).empty());
}

TEST_F(SocketcandSessionTest, StatisticsComeInModeControl) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< statistics 10 >"), "< hi >< ok >< error unknown command >");
  EXPECT_EQ(say(session, "< send 123 3 1 2 3 >"), "");
  EXPECT_EQ(say(session, "< controlmode >< statistics 10 >"), "< ok >");
  EXPECT_EQ(say(session, "< send 123 0 >"), "< error unknown command >");
  peer_sends({0x181, {1, 2, 3, 4}});
  peer_sends({0x182, {1}});
  std::string told;
  for (int ms = 0; ms < 25; ++ms) told += forwarded(session);
  EXPECT_EQ(told, "< stat 5 2 3 1 >< stat 5 2 3 1 >");
  EXPECT_EQ(say(session, "< statistics 0 >"), "");
  for (int ms = 0; ms < 25; ++ms) EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< echo >"), "< echo >");
}

TEST_F(SocketcandSessionTest, RemoteFramesAreSentByTheirFlag) {
  SocketcandSession session(pool_, counters_, wall_);
  enter_rawmode(session);
  EXPECT_EQ(say(session, "< send 40000705 1 0 >"), "");
  EXPECT_EQ(forwarded(session), "");
  can::StampedFrame frame;
  ASSERT_TRUE(rarm_.computer_port().receive(frame));
  EXPECT_TRUE(frame.frame.remote);
  EXPECT_TRUE(frame.frame.extended);
  EXPECT_EQ(frame.frame.id, 0x705U);
  EXPECT_EQ(frame.frame.length, 1);
}

TEST_F(SocketcandSessionTest, FramesGoBothWaysAndAreNotEchoed) {
  SocketcandSession session(pool_, counters_, wall_);
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
  // The time is bus time: the frame was on the wire for 111..135 bits of 1 us.
  const double s = std::stod(text.substr(text.find("58B") + 4));
  EXPECT_NEAR(s, std::chrono::duration<double>(before).count() + 118e-6, 20e-6);
  EXPECT_EQ(counters_.sent, 1U);
  EXPECT_EQ(counters_.received, 1U);
}

TEST_F(SocketcandSessionTest, NothingOfABusReachesAClientBeforeRawmode) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >"), "< hi >< ok >");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< send 80 0  >"), "");
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(counters_.sent, 1U);
}

TEST_F(SocketcandSessionTest, TheReplyToRawmodeStandsAlone) {
  SocketcandSession session(pool_, counters_, wall_);
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
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< rawmode >"), "< hi >< ok >< ok >");
  peer_sends({0x701, {5}});
  wall_ += seconds(10);
  EXPECT_EQ(forwarded(session), "");
  wall_ += milliseconds(100);
  EXPECT_EQ(forwarded(session), "");
}

TEST_F(SocketcandSessionTest, WhoSpeaksHasReadTheReply) {
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >< rawmode >"), "< hi >< ok >< ok >");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(say(session, "< send 80 0  >"), "");
  EXPECT_THAT(forwarded(session), StartsWith("< frame 701 "));
}

/// Processes a stream as python-can 4.1.0 does (can/interfaces/socketcand): 1024 characters at a time,
/// dropping the first character of what is left after the last whole message.
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
  SocketcandSession session(pool_, counters_, wall_);
  enter_rawmode(session);
  for (std::uint32_t i = 0; i < 200; ++i) peer_sends({0x180 + i % 100, std::vector<std::uint8_t>(i % 9)});
  rarm_.advance(rarm_.now() + milliseconds(50));
  session.forward(wall_);
  const std::string text = drained(session);
  ASSERT_GT(text.size(), 6'000U);
  EXPECT_EQ(frames_python_can_reads(text), 200);
  // Without the line feeds the reader would lose some frames, hence the separation.
  std::string bare = text;
  std::erase(bare, '\n');
  EXPECT_LT(frames_python_can_reads(bare), 200);
  EXPECT_EQ(text.substr(0, 1000).find('\n'), std::string::npos);
}

TEST_F(SocketcandSessionTest, ASlowClientLosesFramesButNotReplies) {
  SocketcandSession session(pool_, counters_, wall_);
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
  SocketcandSession session(pool_, counters_, wall_);
  EXPECT_EQ(say(session, "< open rarm >"), "< hi >< ok >");
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
  EXPECT_TRUE(replies == flood);
}

TEST_F(SocketcandSessionTest, AFloodWaitsForTheBusAndLosesNothing) {
  SocketcandSession session(pool_, counters_, wall_);
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
  SocketcandSession session(pool_, counters_, wall_);
  enter_rawmode(session);
  can::Frame remote(0x705, {});
  remote.remote = true;
  peer_sends(remote);
  EXPECT_EQ(forwarded(session), "");
  EXPECT_EQ(counters_.skipped, 1U);
}

TEST_F(SocketcandSessionTest, BusOffIsToldAndOver) {
  SocketcandSession session(pool_, counters_, wall_);
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

TEST_F(SocketcandSessionTest, FdFramesHaveMessagesOfTheirOwn) {
  bus::CanBus fast("fast", "can_fast", {.fd = true});
  std::array<bus::CanBus*, 1> buses{&fast};
  ControllerPool pool(buses);
  SocketcandSession session(pool, counters_, wall_);
  EXPECT_EQ(say(session, "< open fast >< fdsend 123 1 0 >"), "< hi >< ok >< error unknown command >");
  EXPECT_EQ(say(session, "< rawmode >< echo >"), "< ok >< echo >");
  can::Frame frame(0x181, std::vector<std::uint8_t>(12, 0xAB));
  frame.fd = true;
  ASSERT_EQ(fast.computer_port().send(frame), can::SendResult::kQueued);
  fast.advance(milliseconds(1));
  session.forward(wall_);
  EXPECT_THAT(drained(session), testing::MatchesRegex("< fdframe 181 01 0\\.[0-9]+ (AB){12} >"));
  EXPECT_EQ(say(session, "< fdsend 123 1 12 1 2 3 4 5 6 7 8 9 a b c >"), "");
  fast.advance(milliseconds(2));
  can::StampedFrame received;
  ASSERT_TRUE(fast.computer_port().receive(received));
  EXPECT_TRUE(received.frame.fd);
  EXPECT_EQ(received.frame.length, 12);
  EXPECT_EQ(received.frame.data[11], 0x0C);
  // A length without a DLC code, and a bus without FD frames.
  EXPECT_EQ(say(session, "< fdsend 123 1 9 1 2 3 4 5 6 7 8 9 >"), "< error no such frame on this bus >");
  SocketcandSession classical(pool_, counters_, wall_);
  enter_rawmode(classical);
  EXPECT_EQ(say(classical, "< fdsend 123 1 1 5 >"), "< error no such frame on this bus >");
}

TEST_F(SocketcandSessionTest, AMessageWithoutAnEndClosesTheConnection) {
  SocketcandSession session(pool_, counters_, wall_);
  enter_rawmode(session);
  EXPECT_EQ(say(session, "< send " + std::string(1'000'000, '1')), "");
  EXPECT_EQ(last_, Step::kClosed);
}

TEST_F(SocketcandSessionTest, EndsAreUsedAgain) {
  for (int i = 0; i < 50; ++i) {
    SocketcandSession one(pool_, counters_, wall_);
    SocketcandSession two(pool_, counters_, wall_);
    enter_rawmode(one);
    enter_rawmode(two);
    // Nothing that an earlier client left unread reaches the next one.
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
  const std::string alphabet = "  01f8";
  const std::string verbs[] = {"send 7",          "add 0 1000 1", "filter 0 0 1", "muxfilter 0 0 1 2 ",
                               "subscribe 0 9 1", "rawmode",      "bcmmode",      "controlmode",
                               "statistics 1",    "fdsend 1 1 ",  "delete 1",     "unsubscribe 1",
                               "update 1 1 ",     "echo",         "open rarm"};
  int closed = 0;
  for (int run = 0; run < 300; ++run) {
    SocketcandSession session(pool_, counters_, wall_);
    enter_rawmode(session);
    std::string text;
    for (int i = 0; i < 100; ++i) {
      text += "< " + verbs[random() % std::size(verbs)];
      for (std::size_t n = random() % 12; n > 0; --n) text += alphabet[random() % alphabet.size()];
      text += " >";
      if (random() % 200 == 0) text += static_cast<char>(random());
    }
    say(session, text);
    rarm_.advance(rarm_.now() + milliseconds(100));
    session.forward(wall_);
    if (last_ == Step::kClosed) {
      ++closed;
      continue;
    }
    EXPECT_EQ(last_, Step::kNeedMore);
    session.outgoing().clear();
    EXPECT_EQ(say(session, "< echo >"), "< echo >");
  }
  EXPECT_GT(closed, 50);
  EXPECT_LT(closed, 250);
  EXPECT_GT(counters_.errors, 1'000U);
}

}  // namespace
}  // namespace walkman::gateways
