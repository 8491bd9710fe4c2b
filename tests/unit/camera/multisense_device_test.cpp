// The emulated device, asked by a conversation in the protocol's own messages.

#include "emulator/camera/multisense_device.h"

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/camera/camera_rig.h"

namespace walkman {
namespace {

/// Sends requests of its own and counts what comes back.
struct Conversation {
  explicit Conversation(CameraRig& rig) : Conversation(rig.eye) {}
  explicit Conversation(MultiSense& eye) : device(eye) {}
  template <typename Message>
  void ask(const Message& message, MultiSenseDevice::Address from = 1, Time host = {}) {
    send(multisense::encode(message), from, host);
  }
  void send(const std::vector<std::uint8_t>& message, MultiSenseDevice::Address from = 1, Time host = {}) {
    multisense::Fragments fragments(message, 1, multisense::kMostMtu);
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
  /// The message that a query is answered with, or one with its initial values.
  template <typename Message>
  Message answer_to(multisense::Query query) {
    ask(query);
    Message answer;
    MultiSenseDevice::Address to = 0;
    std::vector<std::uint8_t> datagram;
    while (device.next(to, datagram))
      if (const auto it = multisense::decode<Message>(assembler.take(datagram))) answer = *it;
    return answer;
  }
  MultiSenseDevice device;
  multisense::Assembler assembler;
};

TEST(MultiSenseDevice, AcknowledgesEveryRequestOnceAndThenAnswers) {
  using namespace multisense;
  CameraRig rig;
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
  CameraRig rig;
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
  for (const float rate : {0.0F, -1.0F, std::nanf("")}) {
    control.frames_per_second = rate;
    talk.ask(control);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  }
}

TEST(MultiSenseDevice, ListsTheSizesOfBothImagersOfItsKind) {
  using namespace multisense;
  CameraRig rig(1024, 1024);
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
    // The vendor's SaveImageUtility asks for 30 in every mode and gives up if that is refused.
    control.frames_per_second = 30;
    talk.ask(control);
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
    EXPECT_NEAR(rig.eye.rate_hz(), size.fastest, 1e-6);
  }
  talk.ask(Resolution{2048, 1088, 64, 2000, 480});  // cropped by the client
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  // Slower by itself where the size allows no more, and as fast as before where it does.
  talk.ask(Resolution{2048, 2048, 64});
  EXPECT_NEAR(rig.eye.rate_hz(), 3.75, 1e-6);
  talk.ask(Resolution{1024, 1024, 64});
  EXPECT_NEAR(rig.eye.rate_hz(), 15, 1e-6);
}

TEST(MultiSenseDevice, KeepsTheNetworkThatItIsToldAndTheDisparitiesThatItIsNot) {
  using namespace multisense;
  CameraRig rig(1024, 1024);
  Conversation talk(rig);
  talk.ask(Network{1, "10.66.171.21", "10.66.171.1", "255.255.240.0"});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(talk.answer_to<Network>(Query::kNetwork).address, "10.66.171.21");
  talk.ask(Network{1, "10.66.171.256", "10.66.171.1", "255.255.240.0"});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  talk.ask(Resolution{1024, 1024, 256});
  talk.ask(Resolution{2048, 2048, -1});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, 0x0001, 0));
  EXPECT_EQ(rig.eye.mode().disparities, 256);
}

TEST(MultiSenseDevice, AnswersNothingToJunkAndForgetsTheSilent) {
  using namespace multisense;
  CameraRig rig;
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
  CameraRig rig;
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

/// A sender who forges an address must not have the device send much more there than he sent himself.
TEST(MultiSenseDevice, AcknowledgesAQueryWithABodyAndSendsNoAnswer) {
  using namespace multisense;
  CameraRig rig;
  Conversation talk(rig);
  const struct {
    std::uint8_t query;
    int answer;
  } queries[] = {{0x02, 0x0102}, {0x03, 0x0103}, {0x04, 0x0104}, {0x12, 0x010A},
                 {0x17, 0x010C}, {0x18, 0x010D}, {0x1A, 0x0014}, {0x1B, 0x0016},
                 {0x1D, 0x0112}, {0x24, 0x011B}, {0x27, 0x0026}};
  for (const auto& [query, answer] : queries) {
    talk.send({query, 0, 1, 0});
    EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, answer));
    for (const std::size_t body : {1U, 4U, 40U}) {
      std::vector<std::uint8_t> request{query, 0, 1, 0};
      request.resize(4 + body, 0xA5);
      talk.send(request);
      EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown)) << int{query} << ", " << body;
    }
  }
  // Of the requests with a body, only an MTU test has a long answer, and not if it is cut off.
  talk.send({0x21, 0, 1, 0, 0x28, 0x23, 0, 0});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0, 0x0117));
  talk.send({0x21, 0, 1, 0, 0x28, 0x23, 0});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
  talk.ask(Ack{0x17, 0});
  EXPECT_THAT(talk.answers(), testing::IsEmpty()) << "two devices would acknowledge each other for ever";
}

TEST(MultiSenseDevice, ReturnsTheDeviceInformationThatIsSet) {
  using namespace multisense;
  CameraRig rig;
  Conversation talk(rig);
  const auto told = [&] { return talk.answer_to<DeviceInfo>(Query::kDeviceInfo); };
  DeviceInfo info = told();
  info.key = "secret";
  info.name = "of another robot";
  info.serial_number = std::string(kLongestString, '7');
  info.boards = {{"main", 3}, {"imager", 1}};
  info.lights = 2;
  talk.ask(info);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(told().key, "");
  EXPECT_EQ(told().name, info.name);
  EXPECT_EQ(told().serial_number, info.serial_number);
  ASSERT_EQ(told().boards.size(), 2U);
  EXPECT_EQ(told().boards[1].name, "imager");
  EXPECT_EQ(told().lights, 2U);
  EXPECT_EQ(told().imager_width, 2048U);

  // The imager is what it is; and what is malformed changes nothing.
  DeviceInfo wrong = info;
  wrong.name = "wrong";
  wrong.imager_width = 4096;
  talk.ask(wrong);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  wrong = info;
  wrong.name = "wrong";
  wrong.boards.resize(9);
  talk.ask(wrong);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
  wrong.boards.clear();
  std::vector<std::uint8_t> cut = encode(wrong);
  cut.pop_back();
  talk.send(cut);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
  EXPECT_EQ(told().name, info.name);
}

TEST(MultiSenseDevice, ReturnsTheCalibrationThatIsSetForTheRowsInUse) {
  using namespace multisense;
  CameraRig rig(1024, 1024);
  Conversation talk(rig);
  const auto told = [&] { return talk.answer_to<CameraCalibration>(Query::kCameraCalibration); };
  CameraCalibration set = told();
  set.left.D[1] = 0.25F;
  set.left.P[6] = set.left.M[5] = 1000;
  set.right.P[3] = -90;
  talk.ask(set);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(encode(told()), encode(set));
  // Above the middle 1088 of 2048 rows there are 480.
  talk.ask(Resolution{1024, 544, 64});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(told().left.P[6], 520);
  EXPECT_EQ(told().left.M[5], 520);
  EXPECT_EQ(told().right.P[3], -90);
  CameraCalibration cropped = told();
  cropped.left.P[6] = 530;
  talk.ask(cropped);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(encode(told()), encode(cropped));
  talk.ask(Resolution{1024, 1024, 64});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(told().left.P[6], 1010);

  CameraCalibration wrong = set;
  wrong.right.R[4] = std::nanf("");
  talk.ask(wrong);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  std::vector<std::uint8_t> cut = encode(set);
  cut.pop_back();
  talk.send(cut);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
  EXPECT_EQ(told().left.P[6], 1010);
}

TEST(MultiSenseDevice, ReturnsTheTransmitDelayThatIsSet) {
  using namespace multisense;
  CameraRig rig;
  Conversation talk(rig);
  const auto told = [&] { return talk.answer_to<TransmitDelay>(Query::kTransmitDelay).milliseconds; };
  EXPECT_EQ(told(), 0);
  talk.send({0x26, 0, 1, 0, 0x2C, 0x01, 0, 0});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(told(), 300);
  talk.ask(TransmitDelay{-1});
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  EXPECT_EQ(told(), 300);
}

TEST(MultiSenseDevice, ReturnsTheLasersCalibrationThatIsSetIfItHasALaser) {
  using namespace multisense;
  CameraRig rig;
  LidarCalibration set;
  for (std::size_t i = 0; i < 16; ++i) {
    set.X_SpL[i] = static_cast<float>(i);
    set.X_CSp[i] = static_cast<float>(100 + i);
  }
  const auto camera = [&](const std::optional<LaserParts>& laser) {
    Scene scene = rig.scene;
    scene.robot.laser = laser;
    return std::make_unique<MultiSense>(rig.robot, scene,
                                        rig.robot.link_index("multisense/left_camera_optical_frame"),
                                        CameraRig::parameters(64, 48), 1);
  };
  const auto bare = camera(std::nullopt);
  const auto eye = camera(LaserParts{"multisense/head_hokuyo_frame", "hokuyo_joint"});
  Conversation without(*bare), talk(*eye);
  without.ask(set);
  EXPECT_THAT(without.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  without.ask(Query::kLidarCalibration);
  EXPECT_THAT(without.answers(), testing::ElementsAre(0x0001, Ack::kUnknown));
  const auto told = [&] { return talk.answer_to<LidarCalibration>(Query::kLidarCalibration); };
  EXPECT_EQ(told().X_SpL[15], 1);
  talk.ask(set);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, 0));
  EXPECT_EQ(encode(told()), encode(set));
  set.X_CSp[3] = std::numeric_limits<float>::infinity();
  talk.ask(set);
  EXPECT_THAT(talk.answers(), testing::ElementsAre(0x0001, Ack::kUnsupported));
  EXPECT_EQ(told().X_CSp[3], 103);
}

}  // namespace
}  // namespace walkman
