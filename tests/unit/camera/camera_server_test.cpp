// The emulated device and the driver's client at the two ends of a connection over UDP.

#include "emulator/gateways/camera_server.h"

#include <chrono>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/multisense/camera.h"
#include "drivers/camera/multisense/udp_port.h"
#include "tests/unit/camera/camera_rig.h"

namespace walkman {
namespace {

using gateways::CameraServer;
using multisense::Camera;
using ::testing::HasSubstr;

TEST(CameraServer, TheCloudOverUdpIsTheMatchersOwn) {
  CameraRig rig(256, 192);
  CameraServer server(rig.address, rig.eye);
  multisense::UdpPort port(rig.address);
  Camera client(port, "the camera", rig.clock);
  camera::OrganizedCloud cloud;
  EXPECT_FALSE(client.latest(rig.own, cloud));
  for (int frame = 1; frame <= 20; ++frame) {
    rig.own = frame * 100ms;
    rig.advance(rig.own);
    server.publish(rig.own);
    ASSERT_TRUE(client.latest(rig.own, cloud));
    EXPECT_EQ(cloud.stamp, rig.own);
    rig.expect_truth(cloud);
    EXPECT_FALSE(client.latest(rig.own + 1ms, cloud));  // begins to stream anew
  }
  EXPECT_EQ(client.lost_frames(), 0U);
}

/// As many frames of this size over an Ethernet without jumbo frames, each compared with the matcher's if so
/// asked.
void expect_whole_at_an_mtu_of_1500(int frames, int width, int height, bool compared) {
  CameraRig rig(width, height);
  CameraServer server(rig.address, rig.eye);
  multisense::UdpPort direct(rig.address);
  FilteredPort port(direct);
  port.passes = [](const auto& datagram) { return datagram.size() <= 1472; };
  Camera client(port, "the camera", rig.clock);
  camera::OrganizedCloud cloud;
  int clouds = 0;
  for (int frame = 1; frame <= frames; ++frame) {
    rig.own = frame * 100ms;
    static_cast<void>(client.latest(rig.own, cloud));
    rig.advance(rig.own);
    server.publish(rig.own);
    if (!client.latest(rig.own, cloud)) continue;
    ++clouds;
    if (compared) rig.expect_truth(cloud);
  }
  EXPECT_EQ(clouds, frames);
  EXPECT_EQ(client.lost_frames(), 0U);
}

TEST(CameraServer, AThousandFramesAtAnMtuOf1500AreWhole) {
  // 98 kB of disparities each, which leave in four bursts a millisecond apart.
  expect_whole_at_an_mtu_of_1500(1000, 256, 256, false);
}

TEST(CameraServer, AtFullSizeEveryPointArrivesAtAnMtuOf1500) {
  expect_whole_at_an_mtu_of_1500(5, 1024, 1024, true);
}

/// Streams disparity images and counts them.
struct Viewer {
  explicit Viewer(const std::string& address) : port(address) {
    constexpr std::uint64_t kSource = multisense::source::kDisparityLeft;
    const std::vector<std::uint8_t> request = multisense::encode(multisense::StreamControl{kSource, kSource});
    multisense::Fragments(request, 1, 1500).next(datagram);
    port.send(datagram);
  }
  /// Waits until it has as many messages with this id.
  [[nodiscard]] bool has(std::uint16_t id, int count) {
    while (seen[id] < count) {
      if (!port.wait(10s)) return false;
      while (port.receive(datagram)) {
        const auto message = assembler.take(datagram);
        if (!message.empty()) ++seen[*multisense::id_of(message)];
      }
    }
    return true;
  }
  multisense::UdpPort port;
  multisense::Assembler assembler;
  std::vector<std::uint8_t> datagram;
  std::map<std::uint16_t, int> seen;
};

// Without a message from it: silence alone would end its stream after ten seconds.
TEST(CameraServer, AClientThatClosesItsPortGetsNothingMoreAndTheOthersAll) {
  using Clock = std::chrono::steady_clock;
  CameraRig rig;
  CameraServer server(rig.address, rig.eye);
  auto closes = std::make_unique<Viewer>(rig.address), stays = std::make_unique<Viewer>(rig.address);
  ASSERT_TRUE(closes->has(multisense::Ack::kId, 1));
  ASSERT_TRUE(stays->has(multisense::Ack::kId, 1));
  int frames = 0;
  const auto publish = [&] {
    ++frames;
    rig.advance(frames * 100ms);
    server.publish(frames * 100ms);
  };
  // Frames sent for one that the other client receives.
  const auto sent_for_one = [&] {
    const std::uint64_t before = server.served();
    publish();
    EXPECT_TRUE(stays->has(multisense::Disparity::kId, frames));
    return server.served() - before;
  };
  EXPECT_EQ(sent_for_one(), 2U);
  closes.reset();
  auto end = Clock::now() + 1s;
  while (sent_for_one() != 1) ASSERT_LT(Clock::now(), end);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(sent_for_one(), 1U);
  stays.reset();
  end = Clock::now() + 1s;
  for (int unsent = 0; unsent < 5;) {
    ASSERT_LT(Clock::now(), end);
    const std::uint64_t before = server.served();
    publish();
    std::this_thread::sleep_for(20ms);
    unsent = server.served() == before ? unsent + 1 : 0;
  }
}

TEST(CameraServer, PollingNeverWaits) {
  CameraRig rig;
  CameraServer server(rig.address, rig.eye);
  multisense::UdpPort port(rig.address);
  Camera client(port, "the camera", rig.clock);
  client.set_waiting(Camera::Waiting::kPoll);
  camera::OrganizedCloud cloud;
  int calls = 0;
  while (!client.latest(0ms, cloud)) {
    // Slower than the host's clock, so that under a sanitizer, too, the device's answers are no old ones.
    ASSERT_LT(++calls, 60000);
    rig.own = calls * 100us;
    rig.advance(rig.own);
    server.publish(rig.own);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_GE(calls, 1);
  EXPECT_EQ(cloud.points.size(), 64U * 48U);
  EXPECT_LE(cloud.stamp, rig.own);
}

TEST(CameraServer, AnAddressInUseIsToldByName) {
  CameraRig rig;
  const CameraServer server(rig.address, rig.eye);
  try {
    const CameraServer second(rig.address, rig.eye);
    ADD_FAILURE();
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr(rig.address + ":9001: Address already in use"));
  }
}

}  // namespace
}  // namespace walkman
