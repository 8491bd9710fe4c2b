#include "emulator/logs/pcapng_log.h"

#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/logs/candump_log.h"

namespace walkman::bus {
namespace {

using std::chrono::microseconds;

std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// Returns the output of a command; fails the test if it does not exit with 0.
std::string output(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> part;
  while (pipe != nullptr && std::fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  EXPECT_TRUE(pipe != nullptr && pclose(pipe) == 0) << command;
  return text;
}

struct PcapngTest : testing::Test {
  std::filesystem::path file =
      std::filesystem::temp_directory_path() /
      (std::string("walkman_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".pcapng");
  ~PcapngTest() override { std::filesystem::remove(file); }
};

can::Frame with(can::Frame frame, bool can::Frame::*flag) {
  frame.*flag = true;
  return frame;
}

TEST_F(PcapngTest, BytesAreThoseOfTheFormat) {
  {
    PcapngLog log(file);
    log.write("can0", {Time(0x1'0000'0002), {0x185, {0xAA}}});
    log.flush();
  }
  const std::string expected =
      // Section header: magic, version 1.0, length not given.
      std::string("\x0A\x0D\x0D\x0A\x1C\0\0\0\x4D\x3C\x2B\x1A\x01\0\0\0\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF",
                  24) +
      std::string("\x1C\0\0\0", 4) +
      // Interface: link type 227, no limit, if_name "can0", if_tsresol 9, end.
      std::string(
          "\x01\0\0\0\x28\0\0\0\xE3\0\0\0\0\0\0\0\x02\0\x04\0can0\x09\0\x01\0\x09\0\0\0\0\0\0\0\x28\0\0\0",
          40) +
      // Packet: interface 0, time, length of 9 bytes twice, frame, 3 bytes of padding.
      std::string("\x06\0\0\0\x2C\0\0\0\0\0\0\0\x01\0\0\0\x02\0\0\0\x09\0\0\0\x09\0\0\0", 28) +
      std::string("\0\0\x01\x85\x01\0\0\0\xAA\0\0\0\x2C\0\0\0", 16);
  EXPECT_EQ(bytes_of(file), expected);
}

TEST_F(PcapngTest, TsharkReadsWhatTheTextLogSays) {
  if (std::system("command -v tshark > /dev/null") != 0) GTEST_SKIP() << "tshark is not installed";
  can::Frame extended = with({0x12345678, {1, 2, 3}}, &can::Frame::extended);
  can::Frame remote = with({0x705, {}}, &can::Frame::remote);
  can::Frame fd = with({0x191, std::vector<std::uint8_t>(24, 0x5A)}, &can::Frame::fd);
  can::Frame error = with({0x004, {0, 0x20, 0, 0, 0, 0, 0x80, 0}}, &can::Frame::error);
  const std::vector<std::pair<const char*, can::StampedFrame>> frames = {
      {"can_rarm", {Time(48'000), {0x080, {}}}},
      {"can_larm", {Time(48'125), {0x080, {}}}},
      {"can_rarm", {Time(151'200), {0x18B, {0x37, 0x06, 0x08, 0, 0}}}},
      {"can_rarm", {Time(200'000), extended}},
      {"can_larm", {Time(300'000), remote}},
      {"can_larm", {Time(400'001), fd}},
      {"can_rarm", {Time(1'234'567'890), error}},
  };
  const auto text_file = std::filesystem::path(file).replace_extension(".log");
  {
    const auto log = open_can_log(file);
    const auto text = open_can_log(text_file);
    for (const auto& [name, frame] : frames) {
      log->write(name, frame);
      text->write(name, frame);
    }
    log->flush();
    text->flush();
  }
  const std::string text = bytes_of(text_file);
  std::filesystem::remove(text_file);

  // tshark's fields, reassembled into candump lines. For an error report it shows the meaning of the bits,
  // except in the last three bytes.
  const std::string fields = output(
      "tshark -r " + file.string() +
      " -T fields -e frame.interface_name -e frame.time_epoch -e can.id -e can.flags.xtd -e can.flags.rtr"
      " -e can.flags.err -e canfd.flags.brs -e data.data -e can.err.ctrl -e can.err.ctrl.tx_passive"
      " -e can.err.ctrl_specific 2>/dev/null");
  std::istringstream lines(fields);
  std::string rebuilt;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> column;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, '\t');) column.push_back(word);
    column.resize(11);
    long whole = 0;
    long ns = 0;
    ASSERT_EQ(std::sscanf(column[1].c_str(), "%ld.%ld", &whole, &ns), 2) << line;
    std::array<char, 128> head;
    std::snprintf(head.data(), head.size(), "(%010ld.%06ld) %s ", whole, ns / 1000, column[0].c_str());
    rebuilt += head.data();
    std::string data = column[7];
    if (column[5] == "1") {
      rebuilt += column[8] == "1" ? "20000004#" : "20000000#";
      data = "00" + std::string(column[9] == "1" ? "20" : "00") + "000000" + column[10];
    } else {
      std::snprintf(head.data(), head.size(), column[3] == "1" ? "%08lX#" : "%03lX#", std::stoul(column[2]));
      rebuilt += head.data();
    }
    if (column[4] == "1") rebuilt += "R";
    if (column[6] == "1") rebuilt += "#1";
    for (const char c : data) {
      if (std::isxdigit(c) != 0) rebuilt.push_back(static_cast<char>(std::toupper(c)));
    }
    rebuilt += "\n";
  }
  EXPECT_EQ(rebuilt, text);
  // Times in full nanoseconds, and nothing malformed.
  EXPECT_NE(fields.find("\t0.000048125\t"), std::string::npos) << fields;
  EXPECT_EQ(output("tshark -r " + file.string() + " -Y _ws.malformed -T fields -e frame.number 2>/dev/null"),
            "");
  EXPECT_THAT(
      output("tshark -r " + file.string() +
             " -d can.subdissector,canopen -Y canopen -T fields -e frame.number -e canopen.function_code "
             "2>/dev/null"),
      testing::StartsWith("1\t"));
}

TEST_F(PcapngTest, ABatchIsWrittenInOrderOfTime) {
  if (std::system("command -v tshark > /dev/null") != 0) GTEST_SKIP() << "tshark is not installed";
  PcapngLog log(file);
  log.write("can1", {microseconds(30), {0x181, {1}}});
  log.write("can2", {microseconds(20), {0x182, {2}}});
  log.flush();
  EXPECT_EQ(output("tshark -r " + file.string() + " -T fields -e can.id 2>/dev/null"), "386\n385\n");
}

TEST_F(PcapngTest, TheNoteIsTheSectionsComment) {
  if (std::system("command -v capinfos > /dev/null") != 0) GTEST_SKIP() << "capinfos is not installed";
  for (const std::string& note :
       {std::string("INJECTED FAULTS: joint-locked of RElbj"), std::string(2000, 'x')}) {
    PcapngLog log(file, note);
    log.write("can1", {microseconds(30), {0x181, {1}}});
    log.flush();
    EXPECT_THAT(
        output("capinfos -k -c " + file.string() + " 2>&1"),
        testing::AllOf(testing::HasSubstr(note.substr(0, 300)), testing::ContainsRegex("packets: +1")));
  }
}

TEST(OpenCanLog, ChoosesByTheSuffix) {
  const auto folder = std::filesystem::temp_directory_path();
  EXPECT_NE(dynamic_cast<CandumpLog*>(open_can_log(folder / "walkman_x.log").get()), nullptr);
  EXPECT_NE(dynamic_cast<PcapngLog*>(open_can_log(folder / "walkman_x.pcapng").get()), nullptr);
  std::filesystem::remove(folder / "walkman_x.log");
  std::filesystem::remove(folder / "walkman_x.pcapng");
  try {
    const auto log = open_can_log(folder / "walkman_x.blf");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("walkman_x.blf"));
    EXPECT_THAT(error.what(), testing::HasSubstr(".pcapng"));
  }
  EXPECT_THROW(PcapngLog("/nonexistent/x.pcapng"), std::runtime_error);
}

}  // namespace
}  // namespace walkman::bus
