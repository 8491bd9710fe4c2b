#include "emulator/gateways/slcan_port.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "tests/unit/gateways/system_call_count.h"

namespace walkman::gateways {
namespace {

using std::chrono::milliseconds;

class SlcanPortTest : public testing::Test {
 protected:
  SlcanPortTest() {
    std::string name = std::filesystem::temp_directory_path() / "slcan_port_XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~SlcanPortTest() override { std::filesystem::remove_all(folder_); }

  static Descriptor open(const std::string& name) {
    Descriptor terminal(::open(name.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    EXPECT_TRUE(terminal.valid()) << name;
    return terminal;
  }
  void turn(SlcanPort& port, int timeout_ms) {
    pollfd wait{.fd = port.descriptor(), .events = POLLIN, .revents = 0};
    events_ += poll(&wait, 1, timeout_ms);
    port.service();
    bus_.advance(bus_.now() + milliseconds(1));
    port.forward();
  }
  static std::string read(const Descriptor& terminal) {
    std::array<char, 65536> buffer;
    const ssize_t size = ::read(terminal.get(), buffer.data(), buffer.size());
    return size <= 0 ? std::string() : std::string(buffer.data(), static_cast<std::size_t>(size));
  }
  std::string say(SlcanPort& port, const Descriptor& terminal, std::string_view text) {
    EXPECT_EQ(::write(terminal.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
    for (int i = 0; i < 1'000; ++i) {
      turn(port, 1);
      if (std::string answer = read(terminal); !answer.empty()) return answer;
    }
    return "nothing";
  }

  std::filesystem::path folder_;
  bus::CanBus bus_{"rarm", "can_rarm"};
  int events_ = 0;
};

TEST_F(SlcanPortTest, ASessionThroughTheLink) {
  const std::string link = folder_ / "ttyRARM";
  {
    SlcanPort port(bus_, link);
    EXPECT_EQ(std::filesystem::read_symlink(link), port.terminal());
    const Descriptor terminal = open(link);
    EXPECT_EQ(say(port, terminal, "S8\rO\r"), "\r\r");
    EXPECT_EQ(say(port, terminal, "t0800\r"), "z\r");
    turn(port, 0);
    can::StampedFrame frame;
    ASSERT_TRUE(bus_.computer_port().receive(frame));
    EXPECT_EQ(frame.frame.id, 0x80U);
    static_cast<void>(bus_.computer_port().send({0x701, {5}}));
    turn(port, 0);
    turn(port, 0);
    EXPECT_EQ(read(terminal), "t701105\r");
  }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
}

TEST_F(SlcanPortTest, ClosedAndOpenedAgain) {
  SlcanPort port(bus_);
  for (int i = 0; i < 20; ++i) {
    Descriptor terminal = open(port.terminal());
    EXPECT_EQ(say(port, terminal, "Z1\rS8\rO\r"), "\r\r\r") << i;
    // The client dies with a half-written command and unread frames.
    EXPECT_EQ(::write(terminal.get(), "t08", 3), 3);
    static_cast<void>(bus_.computer_port().send({0x701, {5}}));
    turn(port, 0);
    turn(port, 0);
    terminal = Descriptor();
    for (int n = 0; n < 5; ++n) turn(port, 1);
    static_cast<void>(bus_.computer_port().send({0x702, {5}}));
    turn(port, 0);
  }
  const Descriptor terminal = open(port.terminal());
  EXPECT_EQ(say(port, terminal, "F\r"), "\a");
}

TEST_F(SlcanPortTest, ATerminalNobodyHasOpenDoesNotKeepTheOwnerAwake) {
  SlcanPort port(bus_);
  {
    const Descriptor terminal = open(port.terminal());
    EXPECT_EQ(say(port, terminal, "O\r"), "\r");
  }
  for (int n = 0; n < 5; ++n) turn(port, 1);
  events_ = 0;
  for (int n = 0; n < 50; ++n) turn(port, 1);
  EXPECT_LE(events_, 1);
  // But a client that opens it and writes is noticed without a cycle.
  const Descriptor terminal = open(port.terminal());
  ASSERT_EQ(::write(terminal.get(), "V\r", 2), 2);
  pollfd wait{.fd = port.descriptor(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(poll(&wait, 1, 1'000), 1);
  port.service();
  EXPECT_EQ(read(terminal), "V0101\r");
}

TEST_F(SlcanPortTest, CostsNothingWithoutAPeer) {
  SlcanPort port(bus_);
  turn(port, 0);
  test::system_calls = 0;
  for (int i = 0; i < 1'000; ++i) {
    bus_.advance(bus_.now() + milliseconds(1));
    port.forward();
  }
  EXPECT_EQ(test::system_calls, 0);
}

TEST_F(SlcanPortTest, APeerThatReadsNothingLosesWholeFrames) {
  SlcanPort port(bus_);
  const Descriptor terminal = open(port.terminal());
  EXPECT_EQ(say(port, terminal, "O\r"), "\r");
  int sent = 0;
  while (port.counters().dropped == 0 && sent < 100'000) {
    static_cast<void>(bus_.computer_port().send({0x181, {1, 2, 3, 4, 5, 6, 7, 8}}));
    ++sent;
    if (sent % 8 == 0) turn(port, 0);
  }
  for (int n = 0; n < 10; ++n) turn(port, 0);
  ASSERT_GT(port.counters().dropped, 0U);
  std::string text;
  for (int n = 0; n < 500; ++n) {
    text += read(terminal);
    turn(port, 0);
  }
  const std::string line = "t18180102030405060708\r";
  ASSERT_EQ(text.size() % line.size(), 0U);
  for (std::size_t at = 0; at < text.size(); at += line.size()) ASSERT_EQ(text.substr(at, line.size()), line);
  EXPECT_EQ(text.size() / line.size(), port.counters().received);
  EXPECT_EQ(say(port, terminal, "F\r"), "F09\r");
}

TEST_F(SlcanPortTest, AFloodOfGarbage) {
  SlcanPort port(bus_);
  const Descriptor terminal = open(port.terminal());
  const std::string garbage(1'000, 'x');
  for (int i = 0; i < 1'000; ++i) {
    static_cast<void>(!::write(terminal.get(), garbage.data(), garbage.size()));
    turn(port, 0);
  }
  for (int i = 0; i < 10; ++i) turn(port, 0);
  read(terminal);
  EXPECT_EQ(say(port, terminal, "\r"), "\a");
  EXPECT_EQ(say(port, terminal, "V\r"), "V0101\r");
}

TEST_F(SlcanPortTest, ALinkThatCannotBeIsRefused) {
  const std::filesystem::path file = folder_ / "file";
  std::ofstream(file) << "precious";
  try {
    const SlcanPort port(bus_, file);
    FAIL() << "a file is no place for a link";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(file.string() + " exists"));
  }
  EXPECT_TRUE(std::filesystem::is_regular_file(file));
  EXPECT_THROW(SlcanPort(bus_, folder_ / "no" / "folder"), std::runtime_error);
  // Refused as well: somebody's link to something else, and the link of a running emulator.
  std::filesystem::create_symlink(file, folder_ / "bookmark");
  EXPECT_THROW(SlcanPort(bus_, folder_ / "bookmark"), std::runtime_error);
  EXPECT_EQ(std::filesystem::read_symlink(folder_ / "bookmark"), file);
  std::string theirs;
  {
    const SlcanPort other(bus_, folder_ / "live");
    theirs = other.terminal();
    EXPECT_THROW(SlcanPort(bus_, folder_ / "live"), std::runtime_error);
    EXPECT_EQ(std::filesystem::read_symlink(folder_ / "live"), theirs);
    // The port must not remove anything put in the place of its link, whatever that points to.
    std::filesystem::remove(folder_ / "live");
    std::filesystem::create_symlink(theirs, folder_ / "live");
  }
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "live"));
  // A link left behind by a killed process is replaced.
  std::filesystem::create_symlink("/dev/pts/gone", folder_ / "stale");
  const SlcanPort port(bus_, folder_ / "stale");
  EXPECT_EQ(std::filesystem::read_symlink(folder_ / "stale"), port.terminal());
}

}  // namespace
}  // namespace walkman::gateways
