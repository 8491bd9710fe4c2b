#include "emulator/logs/candump_log.h"

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace walkman::bus {
namespace {

using std::chrono::microseconds;

std::string contents(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

struct CandumpLogTest : testing::Test {
  std::filesystem::path file =
      std::filesystem::temp_directory_path() /
      (std::string("walkman_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".log");
  ~CandumpLogTest() override { std::filesystem::remove(file); }
};

TEST_F(CandumpLogTest, LinesAreThoseOfCandump) {
  const Time t = microseconds(12'345'678) + std::chrono::nanoseconds(999);
  EXPECT_EQ(candump_line("can_rarm", {t, {0x185, {0x37, 0x06, 0xE8, 0x03}}}),
            "(0000000012.345678) can_rarm 185#3706E803\n");
  EXPECT_EQ(candump_line("can_rarm", {Time{}, {0x080, {}}}), "(0000000000.000000) can_rarm 080#\n");
  can::Frame remote(0x705, {});
  remote.remote = true;
  EXPECT_EQ(candump_line("can0", {Time{}, remote}), "(0000000000.000000) can0 705#R\n");
  remote.length = 4;
  EXPECT_EQ(candump_line("can0", {Time{}, remote}), "(0000000000.000000) can0 705#R4\n");
  can::Frame extended(0x123, {0xAB});
  extended.extended = true;
  EXPECT_EQ(candump_line("can0", {Time{}, extended}), "(0000000000.000000) can0 00000123#AB\n");
  can::Frame fd(0x181, {1, 2});
  fd.fd = true;
  EXPECT_EQ(candump_line("can0", {Time{}, fd}), "(0000000000.000000) can0 181##10102\n");
  can::Frame error(0x004, {0, 0x08, 0, 0, 0, 0, 0x60, 0});
  error.error = true;
  EXPECT_EQ(candump_line("can0", {Time{}, error}), "(0000000000.000000) can0 20000004#0008000000006000\n");
  // More than ten digits of seconds, the last microsecond before a second.
  EXPECT_EQ(candump_line("can0", {Time(8'999'999'999'999'999'999), {0x080, {}}}),
            "(8999999999.999999) can0 080#\n");
}

TEST_F(CandumpLogTest, ABatchIsWrittenInOrderOfTime) {
  CandumpLog log(file);
  log.write("can_rarm", {microseconds(30), {0x181, {1}}});
  log.write("can_rarm", {microseconds(50), {0x182, {2}}});
  log.write("can_larm", {microseconds(20), {0x183, {3}}});
  log.write("can_larm", {microseconds(30), {0x184, {4}}});
  log.commit();
  log.write("can_rarm", {microseconds(60), {0x185, {5}}});
  log.flush();
  EXPECT_EQ(contents(file),
            "(0000000000.000020) can_larm 183#03\n"
            "(0000000000.000030) can_rarm 181#01\n"
            "(0000000000.000030) can_larm 184#04\n"
            "(0000000000.000050) can_rarm 182#02\n"
            "(0000000000.000060) can_rarm 185#05\n");
}

TEST_F(CandumpLogTest, CanUtilsReadTheFile) {
  if (std::system("command -v log2asc > /dev/null") != 0) GTEST_SKIP() << "can-utils are not installed";
  CandumpLog log(file, "INJECTED FAULTS: " + std::string(2000, 'x'));
  log.write("can_rarm", {microseconds(1'000'000), {0x185, {0x37, 0x06}}});
  log.write("can_rarm", {microseconds(1'250'000), {0x705, {0x05}}});
  log.flush();
  const auto asc = file.string() + ".asc";
  ASSERT_EQ(std::system(("log2asc -I " + file.string() + " -O " + asc + " can_rarm").c_str()), 0);
  const std::string text = contents(asc);
  std::filesystem::remove(asc);
  EXPECT_NE(text.find("185"), std::string::npos) << text;
  EXPECT_NE(text.find("d 2 37 06"), std::string::npos) << text;
  EXPECT_NE(text.find("0.2500"), std::string::npos) << text;
  EXPECT_NE(text.find("d 1 05"), std::string::npos) << text;
}

TEST_F(CandumpLogTest, TellsWhichFileCannotBeWritten) {
  try {
    CandumpLog log("/nonexistent/can.log");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/can.log"), std::string::npos);
  }
  EXPECT_THROW(CandumpLog("/dev/full"), std::runtime_error);
}

// To a writer, a file that may not grow behaves like a full disk.
TEST_F(CandumpLogTest, TellsWhenTheDiskIsFull) {
  CandumpLog full(testing::TempDir() + "walkman_full_disk.log");
  full.write("can0", {Time{}, {0x080, {}}});
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit none{0, before.rlim_max};
  const auto on_limit = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &none), 0);
  EXPECT_THROW(full.flush(), std::runtime_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, on_limit);
}

}  // namespace
}  // namespace walkman::bus
