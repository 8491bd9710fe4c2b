// The driver's client of the camera, at the other end of a connection in memory: the emulated device, and one
// that says what it is told to.

#include <deque>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/multisense/camera.h"
#include "emulator/camera/multisense_port.h"
#include "tests/unit/camera/camera_rig.h"

namespace walkman {
namespace {

using multisense::Camera;
using ::testing::HasSubstr;

TEST(MultiSenseInMemory, TheCloudIsTheMatchersOwnWithTheClientsStamp) {
  CameraRig rig;
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
  CameraRig rig;
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
  CameraRig rig;
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
  CameraRig rig;
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
  CameraRig rig;
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

TEST(MultiSenseInMemory, AFrameWithoutItsMetadataIsLostAndCountsOnce) {
  const struct {
    std::size_t mtu;
    bool whole;  // or the second datagram of the metadata alone
  } losses[] = {{9000, true}, {1500, true}, {1500, false}};
  for (const auto& loss : losses) {
    CameraRig rig;
    MultiSensePort direct(rig.eye);
    FilteredPort port(direct);
    const auto fits = [&](const auto& datagram) { return datagram.size() <= loss.mtu - 28; };
    port.passes = fits;
    Camera client(port, "the camera", rig.clock);
    camera::OrganizedCloud cloud;
    for (int frame = 1; frame <= 12; ++frame) {
      const bool loses = frame % 3 == 0;
      bool metadata = false;
      int piece = 0;
      port.passes = [&](const auto& datagram) {
        if (!fits(datagram)) return false;
        const bool begins = multisense::read_head(datagram)->offset == 0;
        // The message's id follows the datagram's 18 bytes of head.
        if (begins) metadata = datagram[18] == 0x0F && datagram[19] == 0x01;
        piece = begins ? 0 : piece + 1;
        return !(loses && metadata && (loss.whole || piece == 1));
      };
      rig.own = frame * 100ms;
      static_cast<void>(client.latest(rig.own, cloud));
      rig.advance(rig.own);
      EXPECT_EQ(client.latest(rig.own, cloud), !loses) << frame;
    }
    EXPECT_EQ(client.lost_frames(), 4U) << loss.mtu << (loss.whole ? ", whole" : ", in part");
  }
}

TEST(MultiSenseInMemory, ASmallPathGetsSmallDatagrams) {
  CameraRig rig(256, 192);
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
  CameraRig rig;
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

/// The rows of a cropped size are the middle ones, and a client that was there before learns where they are.
TEST(MultiSenseInMemory, ACroppedCloudLiesWhereTheWholeOneDoes) {
  using namespace multisense;
  CameraRig rig(1024, 1024);
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

/// A device that reports what it is told to.
class ReportingPort final : public multisense::DatagramPort {
 public:
  multisense::DeviceInfo info;
  multisense::CameraCalibration calibration;
  multisense::CameraConfig config;

  void send(std::span<const std::uint8_t> datagram) override {
    using multisense::Query;
    const auto message = datagram.subspan(multisense::kDatagramHeadBytes);
    const std::uint16_t id = *multisense::id_of(message);
    if (id == multisense::MtuTest::kId) return push(multisense::MtuAnswer{});
    switch (static_cast<Query>(id)) {
      case Query::kDeviceInfo:
        return push(info);
      case Query::kCameraCalibration:
        return push(calibration);
      case Query::kCameraConfig:
        return push(config);
      case Query::kStatus:
        return push(multisense::Status{});
      default:
        return push(multisense::Ack{id, multisense::Ack::kOk});
    }
  }
  template <typename Message>
  void push(const Message& message) {
    const std::vector<std::uint8_t> bytes = multisense::encode(message);
    multisense::Fragments fragments(bytes, ++sequence_, multisense::kMostMtu);
    while (!fragments.done()) fragments.next(waiting_.emplace_back());
  }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    if (waiting_.empty()) return false;
    datagram = std::move(waiting_.front());
    waiting_.pop_front();
    return true;
  }
  [[nodiscard]] bool wait(Time) override { return !waiting_.empty(); }

 private:
  std::deque<std::vector<std::uint8_t>> waiting_;
  std::uint16_t sequence_ = 0;
};

/// An image of an imager with 2048 columns: each of its pixels is of `1 / across` columns and `1 / down`
/// rows.
struct ImageMode {
  int imager_rows;    // as the device information states them
  double middle_row;  // where the calibration has the optical axis
  int width, height;
  double across, down;
  double first_row;  // of the calibration's rows
};
constexpr double kFocal = 1200, kBaseline = 0.07, kMiddleColumn = 1023.5;  // px, m, px

ReportingPort device_in(const ImageMode& mode) {
  ReportingPort port;
  port.info.imager_width = 2048;
  port.info.imager_height = static_cast<std::uint32_t>(mode.imager_rows);
  const auto f = static_cast<float>(kFocal), cx = static_cast<float>(kMiddleColumn);
  const auto cy = static_cast<float>(mode.middle_row);
  for (auto* camera : {&port.calibration.left, &port.calibration.right})
    camera->P = {f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0};
  port.calibration.right.P[3] = static_cast<float>(-kFocal * kBaseline);
  port.config.width = static_cast<std::uint16_t>(mode.width);
  port.config.height = static_cast<std::uint16_t>(mode.height);
  port.config.fx = static_cast<float>(kFocal * mode.across);
  port.config.fy = static_cast<float>(kFocal * mode.down);
  port.config.cx = static_cast<float>(kMiddleColumn * mode.across);
  port.config.cy = static_cast<float>((mode.middle_row - mode.first_row) * mode.down);
  return port;
}

/// Sends a frame whose pixels all have this disparity, in 1/16 px; returns whether a cloud comes of it.
bool see(ReportingPort& port, Camera& client, std::uint16_t disparity, camera::OrganizedCloud& cloud) {
  static_cast<void>(client.latest(0s, cloud));
  multisense::ImageMetadata metadata;
  metadata.frame = 1;
  port.push(metadata);
  const std::size_t pixels = std::size_t{port.config.width} * port.config.height;
  port.push(multisense::Disparity{1, port.config.width, port.config.height,
                                  std::vector<std::uint16_t>(pixels, disparity)});
  // The first of these may request what the client does not know yet of this size.
  for (int i = 0; i < 3; ++i)
    if (client.latest(0s, cloud)) return true;
  return false;
}

// The modes of a MultiSense-SL with 1088 rows, and of one with 2048 that uses all of them or the middle ones
// alone and states either number.
TEST(MultiSenseClient, ACloudIsTheSameSurfaceInEveryModeOfTheImager) {
  const ImageMode modes[] = {
      {1088, 543.5, 2048, 1088, 1, 1, 0},       {1088, 543.5, 1024, 544, 0.5, 0.5, 0},
      {1088, 543.5, 2048, 544, 1, 0.5, 0},      {1088, 543.5, 1024, 272, 0.5, 0.25, 0},
      {2048, 1023.5, 1024, 1024, 0.5, 0.5, 0},  {2048, 1023.5, 2048, 1088, 1, 1, 480},
      {2048, 1023.5, 1024, 544, 0.5, 0.5, 480},
  };
  for (const ImageMode& mode : modes) {
    SCOPED_TRACE(std::to_string(mode.width) + " by " + std::to_string(mode.height) + " of " +
                 std::to_string(mode.imager_rows));
    ReportingPort port = device_in(mode);
    Camera client(port, "the camera", [] { return Time(5s); });
    camera::OrganizedCloud cloud;
    const double z = 2.1;  // 40 px in all columns of the imager
    ASSERT_TRUE(see(port, client, static_cast<std::uint16_t>(16 * 40 * mode.across), cloud));
    ASSERT_EQ(cloud.width, mode.width);
    ASSERT_EQ(cloud.height, mode.height);
    for (int v = 0; v < mode.height; v += 17) {
      for (int u = 0; u < mode.width; u += 31) {
        const double column = u / mode.across, row = mode.first_row + v / mode.down;
        const Eigen::Vector3d expected((column - kMiddleColumn) * z / kFocal,
                                       (row - mode.middle_row) * z / kFocal, z);
        ASSERT_LT((cloud.at(u, v).cast<double>() - expected).norm(), 1e-5) << u << ", " << v;
      }
    }
  }
}

TEST(MultiSenseClient, AConfigurationThatProjectsNothingIsToldByName) {
  ReportingPort port = device_in({1088, 543.5, 1024, 272, 0.5, 0.25, 0});
  port.config.fy = 0;
  Camera client(port, "the camera", [] { return Time(5s); });
  camera::OrganizedCloud cloud;
  try {
    static_cast<void>(see(port, client, 320, cloud));
    ADD_FAILURE();
  } catch (const camera::Lost& lost) {
    EXPECT_THAT(lost.what(), HasSubstr("the camera: a focal length of 600 by 0 px"));
  }
}

// Another size than the frame's says nothing about the frame.
TEST(MultiSenseClient, AConfigurationOfAnotherSizeIsNotUsed) {
  ReportingPort port = device_in({1088, 543.5, 1024, 272, 0.5, 0.25, 0});
  Camera client(port, "the camera", [] { return Time(5s); });
  camera::OrganizedCloud cloud;
  const multisense::CameraConfig right = port.config;
  static_cast<void>(client.latest(0s, cloud));
  multisense::ImageMetadata metadata;
  metadata.frame = 1;
  port.push(metadata);
  port.push(multisense::Disparity{1, 1024, 272, std::vector<std::uint16_t>(1024 * 272, 320)});
  port.config.height = 544;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(client.latest(0s, cloud));
  port.config = right;
  EXPECT_FALSE(client.latest(0s, cloud));  // has what was sent before, and asks again
  EXPECT_TRUE(client.latest(0s, cloud));
}

}  // namespace
}  // namespace walkman
