#include "emulator/gateways/socketcand_protocol.h"

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace walkman::gateways {
namespace {

using Kind = SocketcandCommand::Kind;
using Result = SocketcandReader::Result;
using std::chrono::microseconds;
using std::chrono::seconds;

std::string written(const can::Frame& frame, Time time) {
  TextLine line;
  EXPECT_TRUE(write_socketcand({time, frame}, SocketcandData::kTogether, line));
  return std::string(line.text());
}

/// Returns everything a reader reports about a stream: messages verbatim, anything else as "!garbage", which
/// ends it.
std::vector<std::string> told(SocketcandReader& reader, std::string_view stream) {
  std::vector<std::string> all;
  for (;;) {
    switch (reader.read(stream)) {
      case Result::kNeedMore:
        EXPECT_TRUE(stream.empty());
        return all;
      case Result::kMessage:
        all.emplace_back(reader.message());
        break;
      case Result::kGarbage:
        all.emplace_back("!garbage");
        return all;
    }
  }
}

TEST(SocketcandReader, FindsMessagesInPiecesOfAnySize) {
  const std::string stream = "< open can_rarm >< rawmode >\n < send 80 0  >\r\n<echo>";
  const std::vector<std::string> expected = {" open can_rarm ", " rawmode ", " send 80 0  ", "echo"};
  SocketcandReader whole;
  EXPECT_EQ(told(whole, stream), expected);
  SocketcandReader single;
  std::vector<std::string> all;
  for (const char c : stream) {
    for (auto& message : told(single, {&c, 1})) all.push_back(std::move(message));
  }
  EXPECT_EQ(all, expected);
}

TEST(SocketcandReader, TellsOfWhatIsNoMessage) {
  using Told = std::vector<std::string>;
  for (const char* text : {"GET / HTTP/1.1\r\n\r\n< echo >", "> < echo >", "x"}) {
    SocketcandReader reader;
    EXPECT_EQ(told(reader, text), Told{"!garbage"}) << text;
  }
  SocketcandReader reader;
  EXPECT_EQ(told(reader, "< echo >< send 1< echo >"), (Told{" echo ", "!garbage"}));
}

TEST(SocketcandReader, IsBounded) {
  constexpr std::size_t kLongest = SocketcandReader::kLongestMessage;
  SocketcandReader inside;
  EXPECT_EQ(told(inside, "<" + std::string(kLongest, ' ') + ">"), std::vector{std::string(kLongest, ' ')});
  EXPECT_EQ(told(inside, "<" + std::string(kLongest + 1, ' ') + ">"), std::vector<std::string>{"!garbage"});
  SocketcandReader blanks;
  EXPECT_TRUE(told(blanks, std::string(1'000'000, '\n')).empty());
}

TEST(SocketcandCommand, Send) {
  struct Vector {
    const char* text;
    can::Frame frame;
    bool extended;
  };
  const std::vector<Vector> vectors = {
      {" send 80 0  ", {0x80, {}}, false},  // python-can's SYNC
      {" send 0 2 1 0 ", {0x000, {1, 0}}, false},
      {"send 605 8 40 0 10 0 0 0 0 0", {0x605, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}}, false},
      {" send 7FF 8 ff FF 0a A b 0c 7 80 ", {0x7FF, {255, 255, 10, 10, 11, 12, 7, 128}}, false},
      {" send 005 1 5 ", {0x005, {5}}, false},
      {" send 1AAAAAAA 2 1 F1 ", {0x1AAAAAAA, {0x01, 0xF1}}, true},
      {" send 00000005 0 ", {0x5, {}}, true},
      {" send 800 0 ", {0x800, {}}, true},
      {" send 80 00 ", {0x80, {}}, false},
      {" send 98FF1234 1 7f ", {0x18FF1234, {0x7F}}, true},
      // Signed identifiers and bytes.
      {" send ffffffff98ff1234 2 ffffffffffffff80 7f ", {0x18FF1234, {0x80, 0x7F}}, true},
      {" send 181 2 ffffff80 ffffffff ", {0x181, {0x80, 0xFF}}, false},
  };
  for (const Vector& v : vectors) {
    SocketcandCommand command = parse_socketcand(v.text);
    ASSERT_EQ(command.kind, Kind::kSend) << v.text;
    can::Frame expected = v.frame;
    expected.extended = v.extended;
    EXPECT_EQ(command.frame, expected) << v.text;
  }
}

TEST(SocketcandCommand, WrongSendIsRefused) {
  for (const char* text :
       {" send ", " send 80 ", " send 80 1 ", " send 80 1 1 2 ", " send 80 9 1 2 3 4 5 6 7 8 9 ",
        " send 80 -1 ", " send 80 000 ", " send 80 1 100 ", " send 80 1 ff00 ", " send 80 1 0x1 ",
        " send xyz 0 ", " send -1 0 ", " send 20000000 0 ", " send 123456789 0 ",
        " send 80 1 ffffffffffffff7f ", " send 80 1 11111111111111111 ", " send 80 2 0102 "}) {
    EXPECT_EQ(parse_socketcand(text).kind, Kind::kMalformed) << text;
  }
}

TEST(SocketcandCommand, Others) {
  EXPECT_EQ(parse_socketcand(" open can_rarm ").kind, Kind::kOpen);
  EXPECT_EQ(parse_socketcand(" open can_rarm ").bus, "can_rarm");
  EXPECT_EQ(parse_socketcand("open rarm").bus, "rarm");
  EXPECT_EQ(parse_socketcand(" open ").kind, Kind::kMalformed);
  EXPECT_EQ(parse_socketcand(" open a b ").kind, Kind::kMalformed);
  EXPECT_EQ(parse_socketcand(" rawmode ").kind, Kind::kRawMode);
  EXPECT_EQ(parse_socketcand(" rawmode 1 ").kind, Kind::kMalformed);
  EXPECT_EQ(parse_socketcand(" echo ").kind, Kind::kEcho);
  for (const char* text : {"", " ", " isotpmode ", " RAWMODE ", " sendrtr 123 0 ", " \x01\xff "}) {
    EXPECT_EQ(parse_socketcand(text).kind, Kind::kUnknown) << text;
  }
}

TEST(SocketcandFrame, AsClientsReadIt) {
  EXPECT_EQ(written({0x185, {0x37, 0x06, 0xE8, 0x03}}, seconds(12) + microseconds(345678)),
            "< frame 185 12.345678 3706E803 >");
  EXPECT_EQ(written({0x80, {}}, seconds(1)), "< frame 080 1.000000  >");
  EXPECT_EQ(written({0x7FF, {0, 1, 2, 3, 4, 5, 6, 0xFF}}, std::chrono::nanoseconds(1999)),
            "< frame 7FF 0.000001 00010203040506FF >");
  can::Frame extended(0x12345, {0xAB});
  extended.extended = true;
  EXPECT_EQ(written(extended, seconds(3600)), "< frame 00012345 3600.000000 AB >");
}

TEST(SocketcandFrame, ErrorFramesTellTheirClass) {
  can::Frame error(0x004, {0, 0x20, 0, 0, 0, 0, 0x80, 0});
  error.error = true;
  EXPECT_EQ(written(error, seconds(2)), "< error 004 2.000000 >");
  error.id = 0x20000040;
  EXPECT_EQ(written(error, seconds(2)), "< error 040 2.000000 >");
}

TEST(SocketcandCommand, ThoseOfTheOtherModes) {
  EXPECT_EQ(parse_socketcand(" bcmmode ").kind, Kind::kBcmMode);
  EXPECT_EQ(parse_socketcand(" controlmode ").kind, Kind::kControlMode);
  SocketcandCommand command = parse_socketcand(" add 1 500000 123 2 42 fF ");
  EXPECT_EQ(command.kind, Kind::kAdd);
  EXPECT_EQ(command.interval, std::chrono::milliseconds(1500));
  EXPECT_EQ(command.frame, can::Frame(0x123, {0x42, 0xFF}));
  command = parse_socketcand(" update 123 1 7 ");
  EXPECT_EQ(command.kind, Kind::kUpdate);
  EXPECT_EQ(command.frame, can::Frame(0x123, {7}));
  command = parse_socketcand(" subscribe 0 10 1AAAAAAA ");
  EXPECT_EQ(command.kind, Kind::kSubscribe);
  EXPECT_EQ(command.interval, microseconds(10));
  EXPECT_EQ(command.frame.id, 0x1AAAAAAAU);
  EXPECT_TRUE(command.frame.extended);
  command = parse_socketcand(" filter 0 0 123 1 F0 ");
  EXPECT_EQ(command.kind, Kind::kFilter);
  EXPECT_EQ(command.masks, (std::vector<SocketcandCommand::Mask>{{0xF0}}));
  std::string longest = "muxfilter 0 0 123 257";
  for (int i = 0; i < 257 * 8; ++i) longest += " 1F";
  ASSERT_LE(longest.size(), SocketcandReader::kLongestMessage);
  command = parse_socketcand(longest);
  EXPECT_EQ(command.kind, Kind::kMuxFilter);
  EXPECT_EQ(command.masks.size(), 257U);
  EXPECT_EQ(parse_socketcand(" delete 123 ").kind, Kind::kDelete);
  EXPECT_EQ(parse_socketcand(" unsubscribe 123 ").kind, Kind::kUnsubscribe);
  EXPECT_EQ(parse_socketcand(" statistics 1000 ").interval, seconds(1));
  command = parse_socketcand(" fdsend 123 1 9 1 2 3 4 5 6 7 8 9 ");
  EXPECT_EQ(command.kind, Kind::kSendFd);
  EXPECT_TRUE(command.frame.fd);
  EXPECT_EQ(command.frame.length, 9);
  for (const char* text :
       {" add 1 123 2 42 42 ", " add -1 0 123 0 ", " update 123 ", " subscribe 0 123 ", " filter 0 0 123 ",
        " muxfilter 0 0 123 258 1 ", " delete ", " statistics ", " statistics x ", " fdsend 123 1 65 ",
        " fdsend 123 8 1 ", " bcmmode 1 ", " subscribe 1000000000000 0 123 "}) {
    EXPECT_EQ(parse_socketcand(text).kind, Kind::kMalformed) << text;
  }
}

TEST(SocketcandFrame, FdFramesHaveFlagsRemoteOnesNoMessage) {
  TextLine line;
  can::Frame remote(0x705, {});
  remote.remote = true;
  EXPECT_FALSE(write_socketcand({{}, remote}, SocketcandData::kTogether, line));
  EXPECT_TRUE(line.text().empty());
  can::Frame fd(0x185, std::vector<std::uint8_t>(64, 0xAB));
  fd.fd = true;
  fd.extended = true;
  std::string data;
  for (int i = 0; i < 64; ++i) data += "AB";
  EXPECT_EQ(written(fd, seconds(1)), "< fdframe 00000185 01 1.000000 " + data + " >");
}

TEST(SocketcandReader, AnyBytesAtAll) {
  std::mt19937 random(7);
  const std::string alphabet = "< >0159aAfF sendopenrawmodeecho\r\n\t\0\xff";
  int sends = 0;
  int others = 0;
  for (int run = 0; run < 2'000; ++run) {
    SocketcandReader reader;
    std::string text;
    for (int i = 0; i < 400; ++i) {
      switch (random() % 12) {
        case 0:
          text += static_cast<char>(random());
          break;
        case 1:
          text += "< send " + std::to_string(random() % 1000) + " " + std::to_string(random() % 3) + " ";
          break;
        case 2:
          text += " >";
          break;
        default:
          text += alphabet[random() % alphabet.size()];
      }
    }
    std::string_view input = text;
    while (!input.empty()) {
      const std::size_t before = input.size();
      const Result result = reader.read(input);
      if (result != Result::kMessage) {
        ASSERT_LT(input.size(), before);
        if (result == Result::kGarbage) reader = SocketcandReader();
        continue;
      }
      const SocketcandCommand command = parse_socketcand(reader.message());
      ++(command.kind == Kind::kSend ? sends : others);
      if (command.kind != Kind::kSend) continue;
      ASSERT_LE(command.frame.length, 8);
      ASSERT_LE(command.frame.id, command.frame.extended ? 0x1FFFFFFFU : 0x7FFU);
    }
  }
  EXPECT_GT(sends, 100);
  EXPECT_GT(others, 1'000);
}

}  // namespace
}  // namespace walkman::gateways
