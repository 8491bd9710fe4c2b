// Against the kernel's own CAN stack: needs AF_CAN, an interface vcan0 that is up, and root. Everything sent
// or injected here alongside the class under test goes through plain system calls.

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "drivers/can/socket_can.h"

namespace walkman::test {
namespace {

using can::Frame;
using can::LinkState;
using can::SendResult;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr const char* kBus = "vcan0";

Time monotonic_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

void run(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

std::string why_not() {
  const int probe = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (probe < 0) return std::string("this kernel has no CAN sockets: ") + std::strerror(errno);
  close(probe);
  if (if_nametoindex(kBus) == 0) return "there is no interface vcan0";
  if (geteuid() != 0) return "not root: interfaces cannot be taken down";
  return {};
}

/// Another participant on the bus, using plain system calls.
class Stranger {
 public:
  Stranger() : descriptor_(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW)) {
    const int on = 1;
    setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(kBus));
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Stranger() { close(descriptor_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  bool send(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) const {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), frame.data);
    return write(descriptor_, &frame, sizeof frame) == static_cast<ssize_t>(sizeof frame);
  }
  bool send_fd(std::uint32_t id, std::uint8_t length, std::uint8_t fill) const {
    canfd_frame frame{};
    frame.can_id = id;
    frame.len = length;
    std::memset(frame.data, fill, length);
    return write(descriptor_, &frame, sizeof frame) == static_cast<ssize_t>(sizeof frame);
  }
  /// Returns the next frame within a second; `bytes` is set to what read() returned.
  std::optional<canfd_frame> next(ssize_t* bytes = nullptr) const {
    pollfd wait{descriptor_, POLLIN, 0};
    canfd_frame frame{};
    if (poll(&wait, 1, 1000) != 1) return std::nullopt;
    const ssize_t got = read(descriptor_, &frame, sizeof frame);
    if (got <= 0) return std::nullopt;
    if (bytes != nullptr) *bytes = got;
    return frame;
  }

 private:
  int descriptor_;
};

class SocketCanOnVcan : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string reason = why_not();
    if (!reason.empty()) GTEST_SKIP() << reason;
    set_mtu(16);
  }
  static void set_mtu(int mtu) {
    run(std::string("ip link set vcan0 down && ip link set vcan0 mtu ") + std::to_string(mtu) +
        " && ip link set vcan0 up");
  }
  static std::vector<can::StampedFrame> drain(can::SocketCan& socket) {
    std::vector<can::StampedFrame> frames;
    can::StampedFrame frame;
    // The kernel hands frames over in the background: on a busy machine the first may take a moment.
    pollfd readable{socket.descriptor(), POLLIN, 0};
    poll(&readable, 1, 200);
    std::size_t before = 0;
    do {
      before = frames.size();
      while (socket.receive(frame)) frames.push_back(frame);
    } while (frames.size() > before && poll(&readable, 1, 50) > 0);
    return frames;
  }
};

TEST_F(SocketCanOnVcan, BatchesGoOutInOrderAndOnlyWithFlush) {
  can::SocketCan master(kBus);
  const Stranger stranger;
  for (std::uint8_t i = 0; i < 100; ++i) {
    ASSERT_EQ(master.send(Frame(0x200U + i, {i, 0xAB})), SendResult::kQueued);
  }
  EXPECT_EQ(master.waiting(), 100U);
  master.flush();
  EXPECT_EQ(master.waiting(), 0U);
  for (std::uint8_t i = 0; i < 100; ++i) {
    ssize_t bytes = 0;
    const auto frame = stranger.next(&bytes);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->can_id, 0x200U + i);
    EXPECT_EQ(frame->len, 2);
    EXPECT_EQ(frame->data[0], i);
    EXPECT_EQ(bytes, static_cast<ssize_t>(sizeof(can_frame)));
  }
  EXPECT_TRUE(drain(master).empty()) << "own frames are not received";
}

TEST_F(SocketCanOnVcan, MoreThanTheGatheringPlaceIsHandedOverByItself) {
  can::SocketCanOptions options;
  options.transmit_queue = 16;
  can::SocketCan master(kBus, options);
  const Stranger stranger;
  for (std::uint8_t i = 0; i < 40; ++i) ASSERT_EQ(master.send(Frame(0x300, {i})), SendResult::kQueued);
  master.flush();
  for (std::uint8_t i = 0; i < 40; ++i) EXPECT_EQ(stranger.next()->data[0], i);
}

TEST_F(SocketCanOnVcan, ReceivedFramesHaveMonotonicStampsOfTheirArrival) {
  can::SocketCan master(kBus);
  const Stranger stranger;
  const Time before = monotonic_now();
  for (std::uint8_t i = 0; i < 100; ++i) ASSERT_TRUE(stranger.send(0x181, {i}));
  const Time sent = monotonic_now();
  std::this_thread::sleep_for(milliseconds(50));
  const auto frames = drain(master);
  ASSERT_EQ(frames.size(), 100U);
  Time last = before;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].frame.data[0], i);
    EXPECT_GE(frames[i].time, last - std::chrono::microseconds(50));
    EXPECT_LE(frames[i].time, sent + std::chrono::microseconds(50)) << "stamp of the reading, not of arrival";
    last = frames[i].time;
  }
}

// Frames from another master must be received in order to be reported.
TEST_F(SocketCanOnVcan, EverythingOthersSendIsHeard) {
  can::SocketCan master(kBus);
  const Stranger stranger;
  const std::vector<std::uint32_t> ids = {0x000U,
                                          0x08BU,
                                          0x100U,
                                          0x18BU,
                                          0x20BU,
                                          0x28BU,
                                          0x48BU,
                                          0x58BU,
                                          0x60BU,
                                          0x70BU,
                                          0x7E4U,
                                          0x18BU | CAN_EFF_FLAG,
                                          0x70BU | CAN_RTR_FLAG};
  for (const std::uint32_t id : ids) ASSERT_TRUE(stranger.send(id, {1}));
  static_cast<void>(master.send(can::Frame(0x20B, {0x0F, 0x00})));
  master.flush();
  const auto heard = drain(master);
  ASSERT_EQ(heard.size(), ids.size()) << "all of the others' and none of its own";
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ(heard[i].frame.id, ids[i] & CAN_EFF_MASK);
  EXPECT_TRUE(heard[11].frame.extended);
  EXPECT_TRUE(heard[12].frame.remote);
}

TEST_F(SocketCanOnVcan, FdFramesNeedAnFdInterface) {
  can::SocketCan master(kBus);
  std::array<std::uint8_t, 19> payload{};
  for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = static_cast<std::uint8_t>(i + 1);
  Frame frame(0x20B, payload);
  EXPECT_EQ(master.send(frame), SendResult::kInvalid) << "19 bytes in a classical frame";
  frame.fd = true;
  EXPECT_EQ(master.send(frame), SendResult::kInvalid) << "mtu 16";
  EXPECT_EQ(master.link(), LinkState::kActive);
  set_mtu(72);
  drain(master);
  const Stranger stranger;
  ASSERT_EQ(master.send(frame), SendResult::kQueued) << "mtu 72, on the same socket";
  master.flush();
  ssize_t bytes = 0;
  const auto seen = stranger.next(&bytes);
  ASSERT_TRUE(seen);
  EXPECT_EQ(bytes, static_cast<ssize_t>(sizeof(canfd_frame)));
  EXPECT_EQ(seen->len, 20) << "the next length FD has";
  EXPECT_EQ(seen->data[18], 19);
  EXPECT_EQ(seen->data[19], 0);
  EXPECT_NE(seen->flags & CANFD_BRS, 0);
  ASSERT_TRUE(stranger.send_fd(0x18B, 24, 0x5A));
  const auto got = drain(master);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_TRUE(got[0].frame.fd);
  EXPECT_EQ(got[0].frame.length, 24);
  EXPECT_EQ(got[0].frame.data[23], 0x5A);
}

TEST_F(SocketCanOnVcan, AnFdFrameGatheredBeforeTheMtuShrankDoesNotBlockTheOthers) {
  set_mtu(72);
  can::SocketCan master(kBus);
  Frame fd(0x20B, std::vector<std::uint8_t>(16, 1));
  fd.fd = true;
  ASSERT_EQ(master.send(Frame(0x201, {1})), SendResult::kQueued);
  ASSERT_EQ(master.send(fd), SendResult::kQueued);
  ASSERT_EQ(master.send(Frame(0x202, {2})), SendResult::kQueued);
  set_mtu(16);
  const Stranger stranger;
  master.flush();
  EXPECT_EQ(stranger.next()->can_id, 0x201U);
  EXPECT_EQ(stranger.next()->can_id, 0x202U);
  EXPECT_EQ(master.statistics().dropped, 1U);
  EXPECT_EQ(master.send(fd), SendResult::kInvalid);
}

TEST_F(SocketCanOnVcan, LostFramesAreCounted) {
  can::SocketCanOptions options;
  options.receive_buffer = 106496;  // which the kernel doubles to its default of 212992
  can::SocketCan master(kBus, options);
  const Stranger stranger;
  for (unsigned i = 0; i < 600; ++i) ASSERT_TRUE(stranger.send(0x181, {static_cast<std::uint8_t>(i)}));
  const std::size_t kept = drain(master).size();
  EXPECT_LT(kept, 600U);
  EXPECT_GT(kept, 100U);
  // The count arrives with the first frame queued after the loss.
  ASSERT_TRUE(stranger.send(0x181, {0xFF}));
  EXPECT_EQ(drain(master).size(), 1U);
  EXPECT_EQ(master.receive_overflows(), 600 - kept);
  for (unsigned i = 0; i < 400; ++i) ASSERT_TRUE(stranger.send(0x181, {static_cast<std::uint8_t>(i)}));
  const std::size_t again = drain(master).size();
  ASSERT_TRUE(stranger.send(0x181, {0xFF}));
  drain(master);
  EXPECT_EQ(master.receive_overflows(), 600 - kept + 400 - again);
}

TEST_F(SocketCanOnVcan, DownAndUpOnTheSameSocket) {
  can::SocketCan master(kBus);
  const int descriptor = master.descriptor();
  run("ip link set vcan0 down");
  ASSERT_EQ(master.send(Frame(0x201, {1})), SendResult::kQueued) << "nobody has noticed yet";
  master.flush();
  EXPECT_EQ(master.link(), LinkState::kDown);
  EXPECT_EQ(master.waiting(), 0U) << "what was gathered before the break is not sent after it";
  EXPECT_EQ(master.send(Frame(0x202, {2})), SendResult::kInterfaceDown);
  run("ip link set vcan0 up");
  const Stranger stranger;
  master.flush();
  ASSERT_EQ(master.send(Frame(0x203, {3})), SendResult::kQueued);
  EXPECT_EQ(master.link(), LinkState::kActive);
  master.flush();
  EXPECT_EQ(stranger.next()->can_id, 0x203U);
  ASSERT_TRUE(stranger.send(0x181, {9}));
  EXPECT_EQ(drain(master).size(), 1U);
  EXPECT_EQ(master.descriptor(), descriptor);
  EXPECT_EQ(master.generation(), 0U);
}

TEST_F(SocketCanOnVcan, DownIsNoticedAndOvercomeByAListenerToo) {
  can::SocketCan master(kBus);
  run("ip link set vcan0 down");
  EXPECT_TRUE(drain(master).empty());
  EXPECT_EQ(master.link(), LinkState::kDown);
  run("ip link set vcan0 up");
  std::this_thread::sleep_for(milliseconds(120));
  EXPECT_TRUE(drain(master).empty());
  EXPECT_EQ(master.link(), LinkState::kActive);
}

TEST_F(SocketCanOnVcan, DeletedAndMadeAnewIsOpenedAgain) {
  can::SocketCan master(kBus);
  can::SocketCan listener(kBus);
  run("ip link del vcan0");
  EXPECT_TRUE(drain(listener).empty());
  EXPECT_EQ(listener.link(), LinkState::kDown);
  ASSERT_EQ(master.send(Frame(0x201, {1})), SendResult::kQueued);
  master.flush();
  EXPECT_EQ(master.link(), LinkState::kDown);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(master.send(Frame(0x202, {2})), SendResult::kInterfaceDown);
    master.flush();
  }
  run("ip link add dev vcan0 type vcan && ip link set vcan0 up");
  const Stranger stranger;
  master.flush();
  EXPECT_EQ(master.link(), LinkState::kActive);
  EXPECT_EQ(master.generation(), 1U);
  ASSERT_EQ(master.send(Frame(0x203, {3})), SendResult::kQueued);
  master.flush();
  EXPECT_EQ(stranger.next()->can_id, 0x203U);
  std::this_thread::sleep_for(milliseconds(120));
  drain(listener);
  EXPECT_EQ(listener.generation(), 1U);
  ASSERT_TRUE(stranger.send(0x181, {9}));
  EXPECT_EQ(drain(listener).size(), 1U);
  pollfd wait{listener.descriptor(), POLLIN, 0};
  ASSERT_TRUE(stranger.send(0x181, {9}));
  EXPECT_EQ(poll(&wait, 1, 1000), 1) << "the new descriptor is what an event loop waits on";
}

TEST_F(SocketCanOnVcan, AFullKernelQueueDelaysAndNeverReorders) {
  can::SocketCanOptions options;
  options.transmit_queue = 40;
  can::SocketCan master(kBus, options);
  const Stranger stranger;
  run("tc qdisc add dev vcan0 root tbf rate 128kbit burst 160 limit 320");
  int taken = 0;
  SendResult result = SendResult::kQueued;
  for (; taken < 200 && result == SendResult::kQueued; ++taken) {
    result = master.send(Frame(0x201, {static_cast<std::uint8_t>(taken)}));
  }
  --taken;
  EXPECT_EQ(result, SendResult::kQueueFull);
  EXPECT_GT(taken, 40);
  EXPECT_LT(taken, 200);
  EXPECT_GT(master.statistics().queue_full, 0U);
  EXPECT_EQ(master.link(), LinkState::kActive) << "a full queue is no broken link";
  EXPECT_FALSE(master.flush_all(Time{}));
  EXPECT_TRUE(master.flush_all(std::chrono::seconds(2)));
  EXPECT_EQ(master.waiting(), 0U);
  for (int i = 0; i < taken; ++i) {
    const auto frame = stranger.next();
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->data[0], i);
  }
  EXPECT_EQ(master.statistics().dropped, 0U);
  run("tc qdisc del dev vcan0 root");
}

TEST_F(SocketCanOnVcan, ControllerReportsMoveTheLinkState) {
  can::SocketCan master(kBus);
  can::SocketCan device(kBus, can::device_side_options());
  const Stranger stranger;
  const auto report = [&](std::uint32_t classes, std::uint8_t controller) {
    ASSERT_TRUE(stranger.send(CAN_ERR_FLAG | classes, {0, controller, 0, 0, 0, 0, 0x60, 0x21}));
    EXPECT_TRUE(drain(master).empty()) << "reports are not frames of the bus";
  };
  report(0x004, 0x08);
  EXPECT_EQ(master.link(), LinkState::kWarning);
  report(0x004, 0x20);
  EXPECT_EQ(master.link(), LinkState::kPassive);
  EXPECT_EQ(master.send(Frame(0x201, {1})), SendResult::kQueued) << "error-passive still sends";
  report(0x040, 0);
  EXPECT_EQ(master.link(), LinkState::kBusOff);
  EXPECT_EQ(master.send(Frame(0x201, {1})), SendResult::kInterfaceDown);
  EXPECT_EQ(master.waiting(), 0U);
  report(0x100, 0);
  EXPECT_EQ(master.link(), LinkState::kActive);
  EXPECT_EQ(master.send(Frame(0x201, {1})), SendResult::kQueued);
  report(0x004, 0x10);
  report(0x004, 0x40);
  EXPECT_EQ(master.link(), LinkState::kActive);
  report(0x004, 0x01);
  EXPECT_EQ(master.receive_overflows(), 1U) << "lost in the controller";
  EXPECT_EQ(master.statistics().reports, 7U);
  const auto reports = drain(device);
  ASSERT_EQ(reports.size(), 7U);
  EXPECT_TRUE(reports[2].frame.error);
  EXPECT_EQ(reports[2].frame.id, 0x040U);
  EXPECT_EQ(reports[2].frame.data[6], 0x60);
}

TEST_F(SocketCanOnVcan, ReportsCanBeSent) {
  can::SocketCan device(kBus, can::device_side_options());
  can::SocketCan master(kBus);
  Frame report(0x040, {0, 0, 0, 0, 0, 0, 0, 0});
  report.error = true;
  ASSERT_EQ(device.send(report), SendResult::kQueued);
  device.flush();
  drain(master);
  EXPECT_EQ(master.link(), LinkState::kBusOff);
}

TEST_F(SocketCanOnVcan, WhatIsNoCanInterfaceIsNamed) {
  try {
    can::SocketCan socket("lo");
    FAIL() << "opened";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("lo: is not a CAN interface"));
  }
}

}  // namespace
}  // namespace walkman::test
