// The emulated device and the driver's client at the two ends of a connection, in memory and over UDP.

#include "emulator/gateways/camera_server.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <random>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/camera/multisense/camera.h"
#include "drivers/camera/multisense/udp_port.h"
#include "emulator/camera/multisense_port.h"
#include "emulator/plant/plant.h"
#include "urdf/reader/device_table.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using gateways::CameraServer;
using multisense::Camera;
using ::testing::HasSubstr;

/// The scene of Experiment 1, seen by a small camera that exposes every 100 ms.
struct Rig {
  explicit Rig(int width = 64, int height = 48)
      : tree(WALKMAN_SOURCE_TREE),
        scene(load_scene(tree / "urdf/scenes/experiment_1.yaml")),
        robot(load_robot_model(scene.robot.urdf)),
        devices(load_device_table(scene.robot.device_table, robot)),
        plant(robot, scene, devices, plant::load_actuators(tree / "emulator/plant/actuators")),
        eye(robot, scene, robot.link_index("multisense/left_camera_optical_frame"), parameters(width, height),
            1) {
    // A loopback address for each process: tests run side by side.
    const int id = getpid();
    address = "127." + std::to_string(1 + id / 62500 % 250) + "." + std::to_string(1 + id / 250 % 250) + "." +
              std::to_string(1 + id % 250);
  }
  static CameraParameters parameters(int width, int height) {
    CameraParameters out;
    out.rate_hz = 10;
    sensors::StereoOptions& options = out.stereo;
    options.width = width;
    options.height = height;
    options.focal_px = 40.0 * width / 64;
    options.cx = (width - 1) / 2.0;
    options.cy = (height - 1) / 2.0;
    return out;
  }
  void advance(Time now) { eye.advance(now, plant); }

  /// What the matcher itself found, by the camera's geometry.
  [[nodiscard]] std::vector<Eigen::Vector3d> truth() {
    MultiSense::Frame frame;
    eye.render(eye.exposure(), false, frame);
    const multisense::Disparity& image = frame.disparity;
    const sensors::StereoOptions& o = eye.optics();
    std::vector<Eigen::Vector3d> points;
    for (int v = 0; v < o.height; ++v) {
      for (int u = 0; u < o.width; ++u) {
        const double d = image.pixels[points.size()] / 16.0;
        const double z = d > 0 ? o.focal_px * o.baseline / d : std::nan("");
        points.emplace_back((u - o.cx) * z / o.focal_px, (v - o.cy) * z / o.focal_px, z);
      }
    }
    return points;
  }
  void expect_truth(const camera::OrganizedCloud& cloud) {
    const std::vector<Eigen::Vector3d> expected = truth();
    ASSERT_EQ(cloud.points.size(), expected.size());
    int valid = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(cloud.points[i].allFinite(), expected[i].allFinite()) << i;
      if (!expected[i].allFinite()) continue;
      ASSERT_LT((cloud.points[i].cast<double>() - expected[i]).norm(), 1e-5 * expected[i].norm()) << i;
      ++valid;
    }
    EXPECT_GT(valid, cloud.width * cloud.height / 6);
  }

  std::filesystem::path tree;
  Scene scene;
  RobotModel robot;
  DeviceTable devices;
  plant::Plant plant;
  MultiSense eye;
  std::string address;
  Time own{};  // the client's clock
  std::function<Time()> clock = [this] { return own; };
};

/// Lets through what it is told to.
class FilteredPort final : public multisense::DatagramPort {
 public:
  explicit FilteredPort(multisense::DatagramPort& inner) : inner_(inner) {}
  void send(std::span<const std::uint8_t> datagram) override { inner_.send(datagram); }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    while (inner_.receive(datagram))
      if (passes(datagram)) return true;
    return false;
  }
  [[nodiscard]] bool wait(Time limit) override { return inner_.wait(limit); }

  std::function<bool(const std::vector<std::uint8_t>&)> passes = [](const auto&) { return true; };

 private:
  multisense::DatagramPort& inner_;
};

TEST(MultiSenseInMemory, TheCloudIsTheMatchersOwnWithTheClientsStamp) {
  Rig rig;
  MultiSensePort port(rig.eye);
  rig.own = 7000s;  // nothing to do with the emulated clock
  Camera client(port, "the camera", rig.clock);
  EXPECT_EQ(client.device().hardware_revision, 1U);
  camera::OrganizedCloud cloud;
  EXPECT_FALSE(client.latest(7000s, cloud));
  rig.advance(500ms);
  rig.own = 7000s + 500ms;
  ASSERT_TRUE(client.latest(7000s, cloud));
  EXPECT_EQ(cloud.stamp, 7000s + 500ms);
  EXPECT_EQ(cloud.width, 64);
  EXPECT_EQ(cloud.height, 48);
  rig.expect_truth(cloud);
}

TEST(MultiSenseInMemory, EverySourceOfLumaIsServedByItsName) {
  Rig rig;
  MultiSensePort port(rig.eye);
  Camera client(port, "the camera", rig.clock);
  const std::uint64_t sources[] = {multisense::source::kLumaLeft, multisense::source::kLumaRight,
                                   multisense::source::kLumaRectifiedLeft,
                                   multisense::source::kLumaRectifiedRight};
  client.also_stream(sources[0] | sources[1] | sources[2] | sources[3]);
  rig.own = 500ms;
  rig.advance(500ms);
  camera::OrganizedCloud cloud;
  ASSERT_TRUE(client.latest(0s, cloud));
  for (const std::uint64_t source : sources) {
    const multisense::Image* const image = client.image(source);
    ASSERT_NE(image, nullptr) << source;
    EXPECT_EQ(image->pixels.size(), 64U * 48U);
  }
  EXPECT_EQ(client.image(sources[0])->pixels, client.image(sources[2])->pixels);
  EXPECT_EQ(client.image(sources[1])->pixels, client.image(sources[3])->pixels);
  EXPECT_NE(client.image(sources[0])->pixels, client.image(sources[1])->pixels);
}

/// Has datagrams of somebody else come first.
class IntrudedPort final : public multisense::DatagramPort {
 public:
  explicit IntrudedPort(multisense::DatagramPort& inner) : inner_(inner) {}
  void send(std::span<const std::uint8_t> datagram) override { inner_.send(datagram); }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    if (intruders.empty()) return inner_.receive(datagram);
    datagram = intruders.back();
    intruders.pop_back();
    return true;
  }
  [[nodiscard]] bool wait(Time limit) override { return inner_.wait(limit); }

  std::vector<std::vector<std::uint8_t>> intruders;

 private:
  multisense::DatagramPort& inner_;
};

/// Each would be kept until the end: a client must not fill up with what it has no use for.
TEST(MultiSenseInMemory, ImagesThatNobodyAskedForAreNotKept) {
  Rig rig;
  MultiSensePort inner(rig.eye);
  IntrudedPort port(inner);
  Camera client(port, "the camera", rig.clock);
  constexpr std::uint64_t kWanted = multisense::source::kLumaLeft;
  client.also_stream(kWanted);
  camera::OrganizedCloud cloud;
  rig.own = 500ms;
  rig.advance(500ms);
  ASSERT_TRUE(client.latest(0s, cloud));
  ASSERT_NE(client.image(kWanted), nullptr);
  rig.own = 600ms;
  rig.advance(600ms);
  const std::uint64_t strange[] = {0, 1U << 20U, kWanted | 1U << 20U, std::uint64_t{1} << 63U};
  for (const std::uint64_t source : strange) {
    multisense::Image image;
    image.source = source;
    image.frame = static_cast<std::int64_t>(cloud.frame) + 1;
    const auto message = multisense::encode(image);
    multisense::Fragments(message, 7, multisense::kLeastMtu).next(port.intruders.emplace_back());
  }
  const std::uint64_t before = cloud.frame;
  ASSERT_TRUE(client.latest(600ms, cloud));
  ASSERT_EQ(cloud.frame, before + 1);
  EXPECT_NE(client.image(kWanted), nullptr);
  for (const std::uint64_t source : strange) EXPECT_EQ(client.image(source), nullptr) << source;
}

TEST(MultiSenseInMemory, ACloudIsNoOlderThanWanted) {
  Rig rig;
  MultiSensePort port(rig.eye);
  Camera client(port, "the camera", rig.clock);
  camera::OrganizedCloud cloud;
  rig.advance(500ms);
  rig.advance(530ms);  // no exposure is due
  rig.own = 530ms;
  EXPECT_FALSE(client.latest(530ms, cloud));
  rig.advance(570ms);
  rig.own = 570ms;
  EXPECT_FALSE(client.latest(530ms, cloud));
  rig.advance(600ms);
  rig.own = 600ms;
  ASSERT_TRUE(client.latest(530ms, cloud));
  EXPECT_EQ(cloud.stamp, 600ms);
  EXPECT_FALSE(client.latest(601ms, cloud));  // the same frame is not given again
}

TEST(MultiSenseInMemory, ALostDatagramLosesItsFrameAlone) {
  Rig rig;
  MultiSensePort direct(rig.eye);
  FilteredPort port(direct);
  port.passes = [](const auto& datagram) { return datagram.size() <= 1472; };  // an MTU of 1500
  Camera client(port, "the camera", rig.clock);
  camera::OrganizedCloud cloud;
  int datagrams = 0, clouds = 0;
  for (int frame = 1; frame <= 40; ++frame) {
    int of_frame = 0;
    const bool loses = frame % 4 == 0;
    // The tenth of each fourth frame: of the disparity image, behind metadata in three datagrams and an ack.
    port.passes = [&](const auto& datagram) {
      if (datagram.size() > 1472) return false;
      ++datagrams;
      return !(loses && datagram.size() > 1000 && ++of_frame == 4);
    };
    rig.own = frame * 100ms;
    static_cast<void>(client.latest(rig.own, cloud));  // begins to stream, if it does not
    rig.advance(rig.own);
    const bool got = client.latest(rig.own, cloud);
    EXPECT_EQ(got, !loses) << frame;
    if (!got) continue;
    ++clouds;
    EXPECT_EQ(cloud.stamp, rig.own);
    rig.expect_truth(cloud);
  }
  EXPECT_EQ(clouds, 30);
  EXPECT_EQ(client.lost_frames(), 10U);
}

TEST(MultiSenseInMemory, ASmallPathGetsSmallDatagrams) {
  Rig rig(256, 192);
  MultiSensePort direct(rig.eye);
  FilteredPort port(direct);
  std::size_t largest = 0;
  port.passes = [&](const auto& datagram) {
    if (datagram.size() > 1472) return false;
    largest = std::max(largest, datagram.size());
    return true;
  };
  Camera client(port, "the camera", rig.clock);
  camera::OrganizedCloud cloud;
  EXPECT_FALSE(client.latest(0ms, cloud));
  rig.advance(100ms);
  ASSERT_TRUE(client.latest(0ms, cloud));
  rig.expect_truth(cloud);
  EXPECT_EQ(largest, 1472U);
}

TEST(MultiSenseInMemory, NobodyAnswersIsToldByName) {
  Rig rig;
  MultiSensePort direct(rig.eye);
  FilteredPort port(direct);
  port.passes = [](const auto&) { return false; };
  try {
    const Camera client(port, "the camera at 10.66.171.21", rig.clock);
    ADD_FAILURE();
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("the camera at 10.66.171.21: no answer from a MultiSense"));
  }
}

/// Sends requests of its own and counts what comes back.
struct Conversation {
  explicit Conversation(Rig& rig) : device(rig.eye) {}
  template <typename Message>
  void ask(const Message& message, MultiSenseDevice::Address from = 1, Time host = {}) {
    const std::vector<std::uint8_t> bytes = multisense::encode(message);
    multisense::Fragments fragments(bytes, 1, 1500);
    std::vector<std::uint8_t> datagram;
    fragments.next(datagram);
    device.receive(from, datagram, host);
  }
  /// Ids of the messages that come, and the acks' states.
  std::vector<int> answers() {
    std::vector<int> ids;
    MultiSenseDevice::Address to = 0;
    std::vector<std::uint8_t> datagram;
    while (device.next(to, datagram)) {
      const auto message = assembler.take(datagram);
      if (message.empty()) continue;
      ids.push_back(*multisense::id_of(message));
      if (const auto ack = multisense::decode<multisense::Ack>(message)) ids.push_back(ack->status);
    }
    return ids;
  }
  MultiSenseDevice device;
  multisense::Assembler assembler;
};

TEST(MultiSenseDevice, AcknowledgesEveryRequestOnceAndThenAnswers) {
  using namespace multisense;
  Rig rig;
  Conversation talk(rig);
  talk.ask(Query::kStatus);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, 0x0103));
  talk.ask(StreamControl{source::kEverything, 0});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  talk.ask(MtuTest{9000});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, 0x0117));
  talk.ask(MtuTest{9001});
  EXPECT_THAT(talk.answers(), testing::IsEmpty());
  talk.ask(Mtu{100});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  talk.ask(static_cast<Query>(0x0033));
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
}

TEST(MultiSenseDevice, TakesTheModesThatItListsAndKeepsWhatIsSet) {
  using namespace multisense;
  Rig rig;
  Conversation talk(rig);
  talk.ask(Resolution{2048, 1536, 256});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(rig.eye.mode(), (MultiSense::Mode{2048, 1536, 256}));
  EXPECT_NEAR(rig.eye.optics().focal_px, 40 * 32, 1e-9);
  talk.ask(Resolution{1000, 1000, 256});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  CameraControl control;
  control.frames_per_second = 3;
  control.exposure.exposure_us = 1234;
  talk.ask(control);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_NEAR(rig.eye.rate_hz(), 3, 1e-6);
  control.exposure.secondary_count = 3;
  talk.ask(control);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  control.exposure.secondary_count = 0;
  for (const float rate : {0.0F, -1.0F, 1000.0F, std::nanf("")}) {
    control.frames_per_second = rate;
    talk.ask(control);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  }
}

TEST(MultiSenseDevice, ListsTheSizesOfBothImagersOfItsKind) {
  using namespace multisense;
  Rig rig(1024, 1024);
  Conversation talk(rig);
  // Width, height and the most frames per second: carnegierobotics.com, "2 Megapixel or 4 Megapixel?"
  const struct {
    std::uint32_t width, height;
    float fastest;
  } sizes[] = {{1024, 1024, 15}, {2048, 2048, 3.75}, {2048, 1088, 7.5}, {1024, 544, 30}};
  for (const auto& size : sizes) {
    for (const int disparities : {64, 128, 256}) {
      talk.ask(Resolution{size.width, size.height, disparities});
      EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0)) << size.width << " by " << size.height;
    }
    CameraControl control;
    control.frames_per_second = size.fastest;
    talk.ask(control);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0)) << size.width << " by " << size.height;
    control.frames_per_second = size.fastest * 1.01F;
    talk.ask(control);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  }
  // Slower by itself where the size allows no more.
  talk.ask(Resolution{2048, 2048, 64});
  EXPECT_NEAR(rig.eye.rate_hz(), 3.75, 1e-6);
}

/// The rows of a cropped size are the middle ones, and a client that was there before learns where they are.
TEST(MultiSenseInMemory, ACroppedCloudLiesWhereTheWholeOneDoes) {
  using namespace multisense;
  Rig rig(1024, 1024);
  MultiSensePort port(rig.eye);
  Camera client(port, "the camera", rig.clock);
  const auto setting = [&](std::uint32_t width, std::uint32_t height) {
    const std::vector<std::uint8_t> request = encode(Resolution{width, height, 256});
    std::vector<std::uint8_t> datagram;
    Fragments(request, 1, 1500).next(datagram);
    port.send(datagram);
  };
  camera::OrganizedCloud whole, cropped;
  setting(1024, 1024);
  rig.own = 500ms;
  rig.advance(500ms);
  ASSERT_TRUE(client.latest(0s, whole));
  setting(1024, 544);
  for (int i = 1; i < 5 && cropped.points.empty(); ++i) {
    rig.own += 100ms;
    rig.advance(rig.own);
    if (!client.latest(rig.own, cropped)) cropped.points.clear();
  }
  ASSERT_EQ(cropped.height, 544);
  rig.expect_truth(cropped);
  // Row 272 of the one looks along the same rays as row 512 of the other; the matcher's noise is its own.
  int seen = 0, near = 0;
  for (int u = 300; u < 1024; ++u) {
    const Eigen::Vector3f& p = whole.points[512U * 1024U + static_cast<std::size_t>(u)];
    const Eigen::Vector3f& q = cropped.points[272U * 1024U + static_cast<std::size_t>(u)];
    if (!p.allFinite() || !q.allFinite()) continue;
    near += (p - q).norm() < 0.03F * p.z() ? 1 : 0;
    ++seen;
  }
  EXPECT_GT(near, 0.95 * seen);
  EXPECT_GT(seen, 300);
}

TEST(MultiSenseDevice, AnswersNothingToJunkAndForgetsTheSilent) {
  using namespace multisense;
  Rig rig;
  Conversation talk(rig);
  std::mt19937 random(3);
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::uint8_t> junk(random() % 60);
    for (std::uint8_t& byte : junk) byte = static_cast<std::uint8_t>(random());
    talk.device.receive(random(), junk, Time{});
  }
  EXPECT_THAT(talk.answers(), testing::IsEmpty());
  // What has the head of a request and junk behind it is acknowledged, in no more bytes than it had.
  std::size_t in = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> message(10 + random() % 50);
    for (std::uint8_t& byte : message) byte = static_cast<std::uint8_t>(random());
    message[1] |= 0x80;  // no request that there is
    std::vector<std::uint8_t> datagram, back;
    Fragments(message, 1, 1500).next(datagram);
    in += datagram.size();
    talk.device.receive(1, datagram, Time{});
    std::size_t out = 0;
    MultiSenseDevice::Address to = 0;
    while (talk.device.next(to, back)) out += back.size();
    EXPECT_LE(out, datagram.size());
  }
  talk.ask(StreamControl{source::kDisparityLeft, source::kDisparityLeft}, 1, 100s);
  EXPECT_TRUE(talk.device.streams());
  talk.device.stop_silent(110s);
  EXPECT_TRUE(talk.device.streams());
  talk.device.stop_silent(110s + 1ms);
  EXPECT_FALSE(talk.device.streams());
}

TEST(MultiSenseDevice, ServesManyClientsAndLetsTheQuietOneGo) {
  using namespace multisense;
  Rig rig;
  Conversation talk(rig);
  for (MultiSenseDevice::Address client = 0; client < 100; ++client) {
    talk.ask(Query::kVersion, client, client * 1ms);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, 0x0102));
  }
  // One that takes nothing gets no more than a queue full.
  talk.ask(StreamControl{source::kDisparityLeft, source::kDisparityLeft});
  for (int frame = 1; frame <= 100; ++frame) {
    rig.advance(frame * 100ms);
    talk.device.publish(frame * 100ms, rig.eye.exposure(), {});
    talk.ask(Query::kStatus);
  }
  EXPECT_LT(talk.answers().size(), 150U);  // of 300 and 200 of frames
}

TEST(CameraServer, TheCloudOverUdpIsTheMatchersOwn) {
  Rig rig(256, 192);
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
  Rig rig(width, height);
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
  expect_whole_at_an_mtu_of_1500(1000, 128, 96, false);
}

TEST(CameraServer, AtFullSizeEveryPointArrivesAtAnMtuOf1500) {
  expect_whole_at_an_mtu_of_1500(5, 1024, 1024, true);
}

TEST(CameraServer, PollingNeverWaits) {
  Rig rig;
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
  Rig rig;
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
