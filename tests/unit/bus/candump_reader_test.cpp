#include "emulator/logs/candump_reader.h"

#include <fstream>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/logs/candump_log.h"

namespace walkman::bus {
namespace {

using std::chrono::microseconds;

const std::filesystem::path kData = std::filesystem::path(WALKMAN_TEST_DATA) / "can";

std::string refusal(const std::filesystem::path& file) {
  try {
    CandumpReader reader(file);
    LoggedFrame frame;
    for (int i = 0; i < 1000 && reader.next(frame);) ++i;
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

struct BadLog {
  const char* file;
  int line;
  const char* says;
};

TEST(CandumpReader, RefusesMalformedLinesInOneSentence) {
  const std::vector<BadLog> bad = {
      {"bad_identifier.log", 2, "identifier '1G5', expected 3 or 8 hexadecimal digits in range"},
      {"bad_identifier_range.log", 1, "identifier 'FFF'"},
      {"bad_identifier_digits.log", 1, "identifier '0185'"},
      {"bad_data_half_byte.log", 1, "data '0', expected two digits per byte"},
      {"bad_data_nine_bytes.log", 1, "9 data bytes, expected at most 8"},
      {"bad_data_not_hex.log", 1, "data '0Z', expected hexadecimal digits"},
      {"bad_fd_length.log", 1, "9 data bytes, expected a length of CAN FD"},
      {"bad_fd_flags.log", 1, "expected ## and a flags digit"},
      {"bad_remote_length.log", 1, "remote frame '185#R9'"},
      {"bad_error_length.log", 1, "error report of 1 bytes, expected 8"},
      {"bad_time_no_bracket.log", 1, "time '0000000001.000000', expected (seconds.microseconds)"},
      {"bad_time_no_fraction.log", 1, "time '(1)'"},
      {"bad_time_too_long.log", 1, "time '(99999999999.000000)'"},
      {"bad_time_negative.log", 1, "time '(-1.000000)'"},
      {"bad_interface_long.log", 1, "interface 'a_very_long_name_0'"},
      {"bad_frame_missing.log", 1, "frame '', expected identifier#data"},
      {"bad_no_hash.log", 1, "frame '185', expected identifier#data"},
      {"bad_more_behind.log", 1, "additional text after the frame"},
      {"bad_direction.log", 1, "'X' after the frame"},
      {"bad_binary.log", 1, "time '?ELF"},
      {"bad_line_too_long.log", 1, "line of more than 255 characters"},
  };
  for (const BadLog& log : bad) {
    const std::string said = refusal(kData / log.file);
    EXPECT_EQ(said.rfind((kData / log.file).string() + ":" + std::to_string(log.line) + ": ", 0), 0U) << said;
    EXPECT_NE(said.find(log.says), std::string::npos) << log.file << ": " << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
  // Every bad file in the folder is in the list.
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kData)) {
    files += entry.path().filename().string().rfind("bad_", 0) == 0 ? 1U : 0U;
  }
  EXPECT_EQ(files, bad.size());
}

TEST(CandumpReader, TellsWhichFileCannotBeOpened) {
  EXPECT_NE(refusal(kData / "none.log").find("none.log: no such file"), std::string::npos);
  EXPECT_NE(refusal(kData).find("not a regular file but a folder"), std::string::npos);
}

TEST(CandumpReader, ReadsWhatCandumpWrites) {
  CandumpReader reader(kData / "mixed.log");
  LoggedFrame f;
  ASSERT_TRUE(reader.next(f));
  EXPECT_EQ(f.interface_name, "can0");
  EXPECT_EQ(f.stamped.time, microseconds(1'000'000));
  EXPECT_EQ(f.stamped.frame, can::Frame(0x080, {}));
  ASSERT_TRUE(reader.next(f));
  EXPECT_EQ(f.stamped.time, microseconds(1'000'250));
  EXPECT_EQ(f.stamped.frame, can::Frame(0x185, {0x37, 0x06, 0xE8, 0x03}));
  ASSERT_TRUE(reader.next(f));
  EXPECT_EQ(f.interface_name, "vcan1");
  EXPECT_TRUE(f.stamped.frame.remote);
  EXPECT_EQ(f.stamped.frame.length, 0);
  ASSERT_TRUE(reader.next(f));
  EXPECT_EQ(f.stamped.time, microseconds(1'500'000));
  EXPECT_TRUE(f.stamped.frame.extended);
  EXPECT_EQ(f.stamped.frame.id, 0x12345678U);
  ASSERT_TRUE(reader.next(f));
  EXPECT_EQ(f.stamped.time, Time(1'000'000'001));
  EXPECT_TRUE(f.stamped.frame.fd);
  EXPECT_EQ(f.stamped.frame.length, 12);
  EXPECT_EQ(f.stamped.frame.data[11], 0x0B);
  ASSERT_TRUE(reader.next(f));
  EXPECT_TRUE(f.stamped.frame.error);
  EXPECT_FALSE(f.stamped.frame.extended);
  EXPECT_EQ(f.stamped.frame.id, 0x004U);
  EXPECT_EQ(f.stamped.frame.data[6], 0x60);
  ASSERT_TRUE(reader.next(f));
  EXPECT_TRUE(f.stamped.frame.remote);
  EXPECT_EQ(f.stamped.frame.length, 4);
  EXPECT_FALSE(reader.next(f));
  EXPECT_FALSE(reader.next(f));
}

TEST(CandumpReader, ReadsBackEveryLogLineUnchanged) {
  const auto file = std::filesystem::temp_directory_path() / "walkman_read_back.log";
  std::mt19937 random(4);
  std::vector<can::StampedFrame> frames;
  {
    CandumpLog log(file, "INJECTED FAULTS: " + std::string(2000, 'x'));
    for (int i = 0; i < 2000; ++i) {
      can::Frame frame;
      frame.fd = i % 3 == 0;
      frame.error = i % 7 == 1 && !frame.fd;
      frame.extended = !frame.error && random() % 2 == 0;
      frame.remote = !frame.fd && !frame.error && random() % 5 == 0;
      frame.id = random() & (frame.extended || frame.error ? 0x1FFFFFFFU : 0x7FFU);
      frame.length = static_cast<std::uint8_t>(frame.error ? 8 : random() % 9);
      if (frame.fd && random() % 2 == 0) frame.length = random() % 2 == 0 ? 64 : 20;
      for (std::size_t k = 0; k < frame.length && !frame.remote; ++k) {
        frame.data[k] = static_cast<std::uint8_t>(random());
      }
      frames.push_back({microseconds(1000 * i + 7), frame});
      log.write("can_rarm", frames.back());
    }
    log.flush();
  }
  CandumpReader reader(file);
  LoggedFrame f;
  for (const can::StampedFrame& expected : frames) {
    ASSERT_TRUE(reader.next(f));
    ASSERT_EQ(f.interface_name, "can_rarm");
    ASSERT_EQ(f.stamped.time, expected.time);
    ASSERT_EQ(f.stamped.frame, expected.frame);
  }
  EXPECT_FALSE(reader.next(f));
  std::filesystem::remove(file);
}

TEST(CandumpReader, AnyBytesAreReadOrRefused) {
  const auto file = std::filesystem::temp_directory_path() / "walkman_fuzz.log";
  std::mt19937 random(9);
  std::ostringstream text;
  text << std::ifstream(kData / "mixed.log").rdbuf();
  const std::string good = text.str();
  for (int round = 0; round < 200; ++round) {
    std::string bytes = good;
    for (int k = 0; k < 1 + round % 8; ++k) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    std::ofstream(file, std::ios::binary) << bytes;
    const std::string said = refusal(file);
    if (!said.empty()) {
      EXPECT_EQ(said.rfind(file.string() + ":", 0), 0U) << said;
    }
    for (const char c : said) EXPECT_TRUE(c >= ' ' && c <= '~');
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace walkman::bus
