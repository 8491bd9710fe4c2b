// Datagrams of several clients into the emulated camera: complete and truncated requests, and anything else.
// A datagram outside the protocol is not answered. Junk is acknowledged at most: only a query without a body
// and an MTU test, both of which request a long answer, get more, up to one message of the largest MTU. A
// client that does not read costs a bounded amount of memory.

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "emulator/camera/multisense_device.h"
#include "tests/fuzz/input.h"

// Any code that advances a camera reads the plant. Here exposures are supplied directly: the plant, half of
// the emulator, is not linked.
namespace walkman::plant {

const InertialMotion* Plant::camera_motion() const { std::abort(); }
Eigen::Isometry3d Plant::X_WL(int) const { std::abort(); }
Eigen::Isometry3d Plant::X_WO(int) const { std::abort(); }
const SceneObject& Plant::object(int) const { std::abort(); }
double Plant::joint_position(int) const { std::abort(); }

}  // namespace walkman::plant

namespace walkman::fuzz {
namespace {

using multisense::kDatagramHeadBytes;
constexpr std::size_t kAcknowledged = kDatagramHeadBytes + 10;  // bytes
/// Bytes in the datagrams for one request: its acknowledgement, and the longest datagram.
constexpr std::size_t kMostAnswered = kAcknowledged + kDatagramHeadBytes + multisense::kMostMtu;

/// Most bytes that a request may cause to be sent at once.
std::size_t most_answered(std::span<const std::uint8_t> request) {
  const auto head = multisense::read_head(request);
  if (!head || head->offset != 0 || head->message_bytes != request.size() - kDatagramHeadBytes) return 0;
  const auto message = request.subspan(kDatagramHeadBytes);
  const int id = message[0] | message[1] << 8;
  // The vendor's queries, none of which has a body.
  constexpr std::array kQueries = {0x02, 0x03, 0x04, 0x12, 0x17, 0x18, 0x19, 0x1A,
                                   0x1B, 0x1D, 0x1F, 0x20, 0x24, 0x27, 0x28};
  const bool query = message.size() == 4 && std::find(kQueries.begin(), kQueries.end(), id) != kQueries.end();
  const bool mtu_test = message.size() >= 8 && id == 0x21;
  return query || mtu_test ? kMostAnswered : kAcknowledged;
}

/// A base with a box to look at, a camera and a laser on a spindle; nothing moves.
RobotModel camera_head() {
  const char* const urdf = WALKMAN_SOURCE_TREE "/tests/fuzz/camera_head.urdf";
  return load_robot_model(urdf);
}

constexpr int kWidth = 1028, kHeight = 2;

/// Has so few rows that a frame is cast at once, at every size that may be requested.
CameraParameters small_camera() {
  CameraParameters parameters;
  parameters.stereo.width = kWidth;
  parameters.stereo.height = kHeight;
  parameters.stereo.cx = (kWidth - 1) / 2.0;
  parameters.stereo.cy = (kHeight - 1) / 2.0;
  parameters.stereo.threads = 1;
  parameters.laser.beams = 33;
  return parameters;
}

/// The scene, and the camera that looks at it: created once, because that takes as long as a hundred inputs.
class Head {
 public:
  Head() {
    scene_.robot.laser = LaserParts{"laser", "spindle"};
    scene_.robot.camera_imu = "camera";
    camera_ = std::make_unique<MultiSense>(robot_, scene_, robot_.link_index("camera"), small_camera(), 1);
    imu_ = camera_->imu()->config();
    exposure_.poses.assign(1, Eigen::Isometry3d::Identity());
  }
  /// Returns the camera in its state after power-on, except for the inertial unit's sample count.
  MultiSense& reset() {
    camera_->set_mode({kWidth, kHeight, 128});
    camera_->set_rate(2);
    camera_->turn_spindle(0);
    require(camera_->imu()->set(imu_), "what the inertial unit says is set can be set");
    exposure_.frame = 0;
    exposure_.stamp = Time::min();
    return *camera_;
  }
  /// Produces a frame, a turn of the laser and samples of the inertial unit.
  void see(Time now, LaserTurns& turns) {
    exposure_.stamp = now;
    ++exposure_.frame;
    camera_->imu()->advance(now, {});
    auto turn = std::make_shared<LaserTurn>();
    turn->number = exposure_.frame;
    turn->first = now;
    turn->X_WH.assign(20, Eigen::Isometry3d::Identity());
    turn->angles.assign(20, 0.1);
    turn->poses = exposure_.poses;
    turns.push_back(turn);
    while (turns.size() > 3) turns.pop_front();
  }
  [[nodiscard]] const Exposure& exposure() const { return exposure_; }

 private:
  RobotModel robot_ = camera_head();
  Scene scene_;
  std::unique_ptr<MultiSense> camera_;
  multisense::ImuConfig imu_;
  Exposure exposure_;
};

/// Returns a datagram with its head that contains a whole message.
std::vector<std::uint8_t> whole(std::span<const std::uint8_t> message) {
  std::vector<std::uint8_t> datagram;
  multisense::Fragments(message, 7, multisense::kMostMtu).next(datagram);
  return datagram;
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  // Two images of 2 B per pixel, the disparity and the metadata are the longest messages of one frame.
  constexpr std::size_t kMostPerClient = 8 << 20;
  static fuzz::Head head;
  MultiSenseDevice device(head.reset());
  fuzz::Input input(data, size);
  constexpr int kMostFrames = 16;  // each takes 10 ms to cast
  int frames = 0;
  LaserTurns turns;
  static Time now = std::chrono::seconds(1);  // never goes back
  Time host{};
  MultiSenseDevice::Address to = 0;
  std::vector<std::uint8_t> datagram;
  const auto drain = [&] {
    std::size_t bytes = 0;
    while (device.next(to, datagram)) {
      fuzz::require(datagram.size() > fuzz::kDatagramHeadBytes && datagram.size() <= multisense::kMostMtu,
                    "a datagram has a head and a message, and fits");
      fuzz::require((bytes += datagram.size()) <= MultiSenseDevice::kMostClients * kMostPerClient,
                    "what waits for clients is bounded");
    }
    return bytes;
  };
  while (!input.empty()) {
    const unsigned how = input.byte();
    if ((how & 7U) == 0 && ++frames <= kMostFrames) {
      const Time pause = input.pause();
      now += pause;
      host += pause;
      head.see(now, turns);
      device.publish(now, head.exposure(), turns);
      if ((how & 8U) != 0) device.stop_silent(host);
    } else if ((how & 7U) == 1) {
      drain();
    } else if ((how & 7U) == 2) {
      device.forget(how >> 3U);
    } else {
      const auto message = input.bytes(input.byte());
      const bool as_it_is = (how & 7U) == 3, alone = (how & 7U) == 4;
      if (alone) drain();
      const std::vector<std::uint8_t> request =
          as_it_is ? std::vector<std::uint8_t>(message.begin(), message.end()) : fuzz::whole(message);
      const bool known = multisense::read_head(request).has_value();
      const std::size_t before = known ? 0 : device.waiting();
      device.receive(how >> 3U, request, host);
      if (!known)
        fuzz::require(device.waiting() == before, "what is no datagram of the protocol is not answered");
      if (alone)
        fuzz::require(drain() <= fuzz::most_answered(request),
                      "only a query or an MTU test is answered by more than an acknowledgement");
    }
  }
  drain();
  return 0;
}
