// The emulator's server and the driver's client at the two ends of a real socket.

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "drivers/camera/socket_camera.h"
#include "emulator/gateways/cloud_server.h"
#include "emulator/plant/plant.h"
#include "urdf/reader/device_table.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using camera::SocketCamera;
using gateways::CloudServer;
using ::testing::HasSubstr;

/// The scene of Experiment 1, seen by a camera of 64 by 48 pixels that exposes every 100 ms.
struct Rig {
  Rig()
      : tree(WALKMAN_SOURCE_TREE),
        scene(load_scene(tree / "urdf/scenes/experiment_1.yaml")),
        robot(load_robot_model(scene.robot.urdf)),
        devices(load_device_table(scene.robot.device_table, robot)),
        plant(robot, scene, devices, plant::load_actuators(tree / "emulator/plant/actuators")),
        eye(robot, scene, robot.link_index("multisense/left_camera_optical_frame"), small(), 10, 1) {
    // Relative to the test's folder: a local socket's path is short.
    path = "camera-" + std::to_string(getpid()) + ".sock";
    server = std::make_unique<CloudServer>(path, eye);
  }
  static sensors::StereoOptions small() {
    sensors::StereoOptions options;
    options.width = 64;
    options.height = 48;
    options.focal_px = 40;
    options.cx = 31.5;
    options.cy = 23.5;
    return options;
  }
  void publish(Time now) {
    eye.advance(now, plant);
    server->publish(now);
  }

  std::filesystem::path tree;
  Scene scene;
  RobotModel robot;
  DeviceTable devices;
  plant::Plant plant;
  MultiSense eye;
  std::string path;
  std::unique_ptr<CloudServer> server;
  Time own{};  // the client's clock
  std::function<Time()> clock = [this] { return own; };
};

TEST(CloudSocket, HelloTellsClockAndSize) {
  Rig rig;
  rig.publish(1234ms);
  const SocketCamera client(rig.path, rig.clock);
  EXPECT_EQ(client.hello().now, 1234ms);
  EXPECT_EQ(client.hello().width, 64U);
  EXPECT_EQ(client.hello().height, 48U);
}

TEST(CloudSocket, TheCloudIsTheCamerasOwnWithTheClientsStamp) {
  Rig rig;
  SocketCamera client(rig.path, rig.clock);
  camera::OrganizedCloud cloud;
  rig.own = 7000s;  // nothing to do with the emulated clock
  EXPECT_FALSE(client.latest(7000s, cloud));
  rig.publish(500ms);
  rig.publish(530ms);  // no exposure is due: the newest is 30 ms old
  EXPECT_FALSE(client.latest(7000s - 29ms, cloud));
  ASSERT_TRUE(client.latest(7000s - 30ms, cloud));
  EXPECT_EQ(cloud.stamp, 7000s - 30ms);
  EXPECT_EQ(cloud.width, 64);
  EXPECT_EQ(cloud.height, 48);
  camera::OrganizedCloud direct;
  rig.eye.render(rig.eye.exposure(), direct);
  ASSERT_EQ(cloud.points.size(), direct.points.size());
  int valid = 0;
  for (std::size_t i = 0; i < direct.points.size(); ++i) {
    if (std::isnan(direct.points[i].x())) {
      EXPECT_TRUE(std::isnan(cloud.points[i].x()));
    } else {
      EXPECT_EQ(cloud.points[i], direct.points[i]);
      ++valid;
    }
  }
  EXPECT_GT(valid, 500);
  EXPECT_EQ(rig.server->served(), 1U);
}

TEST(CloudSocket, PollingNeverWaits) {
  Rig rig;
  rig.publish(500ms);
  SocketCamera client(rig.path, rig.clock);
  client.set_waiting(SocketCamera::Waiting::kPoll);
  camera::OrganizedCloud cloud;
  int calls = 0;
  while (!client.latest(rig.own, cloud)) {
    ASSERT_LT(++calls, 5000);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_GE(calls, 1);  // the first call asked, and did not wait for the answer
  EXPECT_EQ(cloud.points.size(), 64U * 48U);
}

TEST(CloudSocket, TheFileGoesWithTheServerAndALeftOverOneIsReplaced) {
  Rig rig;
  EXPECT_TRUE(std::filesystem::exists(rig.path));
  EXPECT_THROW(CloudServer(rig.path, rig.eye), std::runtime_error);  // in use
  rig.server.reset();
  EXPECT_FALSE(std::filesystem::exists(rig.path));
  // What a killed process leaves behind: a bound socket file that nobody listens on.
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  rig.path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int dead = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  rig.server = std::make_unique<CloudServer>(rig.path, rig.eye);
  const SocketCamera client(rig.path, rig.clock);
  EXPECT_EQ(client.hello().width, 64U);
}

/// A raw connection to the server.
int connect_raw(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  EXPECT_EQ(connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return socket;
}

TEST(CloudSocket, AClientThatSpeaksSomethingElseIsHungUpOnAndTheNextIsServed) {
  Rig rig;
  rig.publish(500ms);
  const int stranger = connect_raw(rig.path);
  const std::string garbage = "GET / HTTP/1.1\r\nHost: robot\r\n\r\n";
  ASSERT_EQ(send(stranger, garbage.data(), garbage.size(), 0), static_cast<ssize_t>(garbage.size()));
  std::vector<char> bytes(4096);
  std::size_t received = 0;
  ssize_t n = 0;
  while ((n = recv(stranger, bytes.data(), bytes.size(), 0)) > 0) received += static_cast<std::size_t>(n);
  EXPECT_EQ(received, camera::kHeaderBytes + 16);  // the hello, then the end
  close(stranger);
  SocketCamera client(rig.path, rig.clock);
  camera::OrganizedCloud cloud;
  EXPECT_TRUE(client.latest(rig.own, cloud));
}

TEST(CloudSocket, ARequestInSinglesBytesIsARequest) {
  Rig rig;
  const int slow = connect_raw(rig.path);
  for (const std::uint8_t byte : camera::encode_request(0ns)) {
    ASSERT_EQ(send(slow, &byte, 1, 0), 1);
    std::this_thread::sleep_for(1ms);
  }
  std::vector<std::uint8_t> bytes(camera::kHeaderBytes + 16 + camera::kHeaderBytes + 8);
  ASSERT_EQ(recv(slow, bytes.data(), bytes.size(), MSG_WAITALL), static_cast<ssize_t>(bytes.size()));
  EXPECT_EQ(bytes[camera::kHeaderBytes + 16 + 6], 3);  // "none": nothing was published
  close(slow);
}

TEST(CloudSocket, NothingThatTheServerDidNotMakeIsRemoved) {
  Rig rig;
  rig.server.reset();
  const auto refused = [&] {
    try {
      const CloudServer server(rig.path, rig.eye);
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  std::ofstream(rig.path) << "precious";
  EXPECT_THAT(refused(), HasSubstr(rig.path + ": is there already and is not a camera's socket"));
  EXPECT_TRUE(std::filesystem::is_regular_file(rig.path));
  std::filesystem::remove(rig.path);
  std::filesystem::create_symlink("elsewhere", rig.path);
  EXPECT_THAT(refused(), HasSubstr("is there already"));
  EXPECT_TRUE(std::filesystem::is_symlink(rig.path));
  std::filesystem::remove(rig.path);
  // What somebody puts in the socket's place while it is served stays, too.
  rig.server = std::make_unique<CloudServer>(rig.path, rig.eye);
  std::filesystem::remove(rig.path);
  std::ofstream(rig.path) << "precious";
  rig.server.reset();
  EXPECT_TRUE(std::filesystem::is_regular_file(rig.path));
  std::filesystem::remove(rig.path);
}

TEST(CloudSocket, OnlyItsOwnerMayConnect) {
  const Rig rig;
  EXPECT_EQ(std::filesystem::status(rig.path).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

/// How long it takes.
template <typename F>
Time taken(F work) {
  const auto began = std::chrono::steady_clock::now();
  work();
  return std::chrono::steady_clock::now() - began;
}

TEST(CloudSocket, IdleClientsHinderNobody) {
  Rig rig;
  rig.publish(500ms);
  std::vector<int> idle;
  for (std::size_t i = 0; i < 3 * CloudServer::kMaxClients; ++i) idle.push_back(connect_raw(rig.path));
  EXPECT_LT(taken([&] {
              // A second emulator, which looks whether the socket is served.
              EXPECT_THROW(CloudServer(rig.path, rig.eye), std::runtime_error);
              SocketCamera client(rig.path, rig.clock);
              camera::OrganizedCloud cloud;
              EXPECT_TRUE(client.latest(rig.own, cloud));
            }),
            2s);
  for (const int socket : idle) close(socket);
}

TEST(CloudSocket, ClientsThatDoNotReadDelayNobody) {
  Rig rig;
  rig.publish(500ms);
  std::vector<int> slow;
  const std::vector<std::uint8_t> request = camera::encode_request(1s);
  for (int i = 0; i < 6; ++i) {
    slow.push_back(connect_raw(rig.path));
    for (int n = 0; n < 30; ++n)
      (void)send(slow.back(), request.data(), request.size(), MSG_DONTWAIT);  // 1.1 MB
  }
  EXPECT_LT(taken([&] {
              SocketCamera client(rig.path, rig.clock);
              camera::OrganizedCloud cloud;
              for (int i = 0; i < 3; ++i) EXPECT_TRUE(client.latest(rig.own, cloud));
            }),
            3s);
  for (const int socket : slow) close(socket);
}

TEST(CloudSocket, WhoeverAskedForCloudsKeepsHisPlaceWhenManyConnect) {
  Rig rig;
  rig.publish(500ms);
  SocketCamera client(rig.path, rig.clock);
  camera::OrganizedCloud cloud;
  ASSERT_TRUE(client.latest(rig.own, cloud));
  std::vector<int> idle;
  for (std::size_t i = 0; i < 2 * CloudServer::kMaxClients; ++i) idle.push_back(connect_raw(rig.path));
  EXPECT_TRUE(client.latest(rig.own, cloud));
  for (const int socket : idle) close(socket);
}

TEST(CloudSocket, APrivateFolderIsMadeOrChecked) {
  const std::filesystem::path folder = "private-" + std::to_string(getpid());
  gateways::make_private_folder(folder);
  EXPECT_EQ(std::filesystem::status(folder).permissions(), std::filesystem::perms::owner_all);
  gateways::make_private_folder(folder);
  std::filesystem::permissions(folder, std::filesystem::perms::group_exec,
                               std::filesystem::perm_options::add);
  EXPECT_THROW(gateways::make_private_folder(folder), std::runtime_error);
  std::filesystem::remove(folder);
  std::ofstream(folder) << "a file";
  EXPECT_THROW(gateways::make_private_folder(folder), std::runtime_error);
  std::filesystem::remove(folder);
}

/// Serves one connection with the given bytes, in pieces, then hangs up.
class FakeServer {
 public:
  FakeServer(std::string path, std::vector<std::uint8_t> bytes) : path_(std::move(path)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    listener_ = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    thread_ = std::thread([this, bytes = std::move(bytes)] {
      const int peer = accept(listener_, nullptr, nullptr);
      for (const std::uint8_t byte : bytes) (void)send(peer, &byte, 1, MSG_NOSIGNAL);
      // Hangs up on its own side only: what the client still sends must not meet a closed socket first.
      shutdown(peer, SHUT_WR);
      std::array<char, 64> rest;
      while (recv(peer, rest.data(), rest.size(), 0) > 0) {
      }
      close(peer);
    });
  }
  ~FakeServer() {
    thread_.join();
    close(listener_);
    unlink(path_.c_str());
  }

 private:
  std::string path_;
  int listener_;
  std::thread thread_;
};

std::string refusal(const std::string& path, std::vector<std::uint8_t> bytes) {
  const FakeServer server(path, std::move(bytes));
  try {
    SocketCamera client(path, [] { return Time{}; });
    camera::OrganizedCloud cloud;
    (void)client.latest(Time{}, cloud);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

TEST(CloudSocket, TheClientRefusesOtherServersByTheirPath) {
  const std::string path = "other-" + std::to_string(getpid()) + ".sock";
  EXPECT_THAT(refusal(path, {'S', 'S', 'H', '-', '2', '.', '0', '-', 'O', 'p', 'e', 'n'}),
              ::testing::AllOf(HasSubstr(path), HasSubstr("WMCL")));
  EXPECT_THAT(refusal(path, {}), HasSubstr("closed"));
  EXPECT_THAT(refusal(path, camera::encode_none(1s)), HasSubstr("hello"));
  camera::Hello hello;
  hello.width = hello.height = 1;
  std::vector<std::uint8_t> cut = camera::encode(hello);
  const std::vector<std::uint8_t> more = camera::encode_none(1s);
  cut.insert(cut.end(), more.begin(), more.end() - 3);
  EXPECT_THAT(refusal(path, cut), HasSubstr("closed"));
  std::vector<std::uint8_t> twice = camera::encode(hello);
  twice.insert(twice.end(), twice.begin(), twice.end());
  EXPECT_THAT(refusal(path, twice), HasSubstr("out of turn"));
  try {
    const SocketCamera client("nobody-here.sock", [] { return Time{}; });
    FAIL() << "connected to nobody";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("nobody-here.sock: no camera behind this socket"));
  }
}

}  // namespace
}  // namespace walkman
