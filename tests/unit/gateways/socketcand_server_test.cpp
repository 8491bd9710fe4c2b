#include "emulator/gateways/socketcand_server.h"

#include <array>
#include <stdexcept>
#include <string>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "tests/unit/gateways/system_call_count.h"

namespace walkman::gateways {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// A client with its own blocking socket.
class TestClient {
 public:
  explicit TestClient(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    const timeval limit{.tv_sec = 5, .tv_usec = 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  }
  void send(std::string_view text) const {
    EXPECT_EQ(::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  /// Sends as much as it can without blocking.
  std::size_t push(std::string_view text) const {
    const ssize_t size = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return size < 0 ? 0 : static_cast<std::size_t>(size);
  }
  /// Returns the result of one read, if anything has arrived; "closed" at the end.
  std::string read() const {
    std::array<char, 65536> buffer;
    const ssize_t size = recv(socket_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size == 0 || (size < 0 && errno == ECONNRESET)) return "closed";
    return size < 0 ? std::string() : std::string(buffer.data(), static_cast<std::size_t>(size));
  }
  void close() { socket_ = Descriptor(); }

 private:
  Descriptor socket_;
};

class SocketcandServerTest : public testing::Test {
 protected:
  /// Serves as the owner's loop would, until the client has received something or a second has passed.
  std::string answer(const TestClient& client) {
    for (int i = 0; i < 1'000; ++i) {
      turn(1);
      if (std::string text = client.read(); !text.empty()) return text;
    }
    return "nothing";
  }
  void turn(int timeout_ms) {
    pollfd wait{.fd = server_.descriptor(), .events = POLLIN, .revents = 0};
    poll(&wait, 1, timeout_ms);
    server_.service();
    bus_.advance(bus_.now() + milliseconds(1));
    server_.forward();
  }
  void enter_rawmode(const TestClient& client) {
    EXPECT_EQ(answer(client), "< hi >");
    client.send("< open rarm >");
    EXPECT_EQ(answer(client), "< ok >");
    client.send("< rawmode >");
    EXPECT_EQ(answer(client), "< ok >");
    client.send("< echo >");  // ends the pause after the handshake
    EXPECT_EQ(answer(client), "< echo >");
  }

  bus::CanBus bus_{"rarm", "can_rarm"};
  std::array<bus::CanBus*, 1> buses_{&bus_};
  SocketcandServer server_{buses_, {.port = 0}};
};

TEST_F(SocketcandServerTest, FramesCrossBetweenClients) {
  EXPECT_GT(server_.port(), 0);
  const TestClient one(server_.port());
  const TestClient two(server_.port());
  enter_rawmode(one);
  enter_rawmode(two);
  one.send("< send 123 2 1 ff >");
  EXPECT_THAT(answer(two), testing::MatchesRegex("< frame 123 0\\.[0-9]+ 01FF >"));
  EXPECT_EQ(one.read(), "");
  two.send("< send 80 0  >");
  EXPECT_THAT(answer(one), testing::MatchesRegex("< frame 080 0\\.[0-9]+  >"));
}

TEST_F(SocketcandServerTest, ABusyBusDoesNotDisturbTheHandshake) {
  std::uint8_t n = 0;
  const auto busy_answer = [&](const TestClient& client) {
    for (int i = 0; i < 1'000; ++i) {
      static_cast<void>(bus_.computer_port().send({0x181, {n++}}));
      turn(0);
      if (std::string text = client.read(); !text.empty()) return text;
    }
    return std::string("nothing");
  };
  const TestClient client(server_.port());
  EXPECT_EQ(busy_answer(client), "< hi >");
  client.send("< open rarm >");
  EXPECT_EQ(busy_answer(client), "< ok >");
  client.send("< rawmode >");
  EXPECT_EQ(busy_answer(client), "< ok >");
  // The pause after the handshake is ended by the server's own timer, even though no cycle calls it.
  pollfd wait{.fd = server_.descriptor(), .events = POLLIN, .revents = 0};
  static_cast<void>(bus_.computer_port().send({0x182, {}}));
  bus_.advance(bus_.now() + milliseconds(1));
  std::string text;
  for (int i = 0; i < 20 && text.empty(); ++i) {
    ASSERT_EQ(poll(&wait, 1, 1'000), 1);
    server_.service();
    text = client.read();
  }
  EXPECT_THAT(text, HasSubstr("< frame 182 "));
  EXPECT_EQ(poll(&wait, 1, 100), 0);
}

TEST_F(SocketcandServerTest, DisconnectedMidLine) {
  const TestClient witness(server_.port());
  enter_rawmode(witness);
  for (int i = 0; i < 100; ++i) {
    TestClient client(server_.port());
    enter_rawmode(client);
    client.send("< send 123 8 1 2");
    client.close();
  }
  for (int i = 0; i < 10; ++i) turn(1);
  EXPECT_EQ(server_.clients(), 1U);
  EXPECT_EQ(server_.counters().sent, 0U);
  witness.send("< echo >");
  EXPECT_EQ(answer(witness), "< echo >");
}

TEST_F(SocketcandServerTest, AMegabyteWithoutAnEnd) {
  const TestClient witness(server_.port());
  enter_rawmode(witness);
  for (const char filler : {'<', '1', '\0'}) {
    const TestClient client(server_.port());
    enter_rawmode(client);
    const std::string megabyte(1'000'000, filler);
    std::string_view left = megabyte;
    bool closed = false;
    std::string told;
    for (int i = 0; i < 2'000 && !closed && !left.empty(); ++i) {
      left.remove_prefix(client.push(left.substr(0, 50'000)));
      turn(0);
      const std::string text = client.read();
      closed = text == "closed";
      told += text;
    }
    EXPECT_TRUE(closed || told.find("< error ") != std::string::npos) << static_cast<int>(filler);
  }
  witness.send("< echo >");
  EXPECT_EQ(answer(witness), "< echo >");
}

TEST_F(SocketcandServerTest, ASlowClientLosesFramesAndNobodyElseDoes) {
  const TestClient slow(server_.port());
  const TestClient fast(server_.port());
  enter_rawmode(slow);
  enter_rawmode(fast);
  std::string text;
  constexpr int kFrames = 200'000;
  int n = 0;
  for (; n < kFrames && server_.counters().dropped == 0; ++n) {
    ASSERT_EQ(bus_.computer_port().send({0x181, {1, 2, 3, 4, 5, 6, 7, 8}}), can::SendResult::kQueued);
    if (n % 6 != 5) continue;
    turn(0);
    text += fast.read();
  }
  ASSERT_GT(server_.counters().dropped, 0U);
  for (int i = 0; i < 100; ++i) {
    turn(1);
    text += fast.read();
  }
  std::size_t frames = 0;
  for (std::size_t at = text.find("< frame "); at != std::string::npos; at = text.find("< frame ", at + 1)) {
    ++frames;
  }
  EXPECT_EQ(frames, static_cast<std::size_t>(n));
}

TEST_F(SocketcandServerTest, AFloodOfCommandsIsSlowedDown) {
  const TestClient client(server_.port());
  enter_rawmode(client);
  std::string flood;
  for (int i = 0; i < 1'000; ++i) flood += "< send 123 8 1 2 3 4 5 6 7 8 >";
  std::size_t pushed = 0;
  for (int i = 0; i < 1'000; ++i) {
    // Only whole messages: a truncated one would be completed by the first of the next round.
    for (std::size_t size = 0; size < flood.size();) {
      const std::size_t sent = client.push(std::string_view(flood).substr(size));
      if (sent == 0) {
        turn(0);
        continue;
      }
      size += sent;
    }
    pushed += 1'000;
    if (server_.counters().sent > 20'000) break;
    turn(0);
  }
  for (int i = 0; i < 20'000 && server_.counters().sent < pushed; ++i) turn(0);
  EXPECT_EQ(server_.counters().sent, pushed);
  EXPECT_EQ(server_.counters().errors, 0U);
}

TEST_F(SocketcandServerTest, AWebPageIsHungUpOn) {
  const TestClient browser(server_.port());
  browser.send("POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n< open rarm >< send 0 2 81 0 >");
  std::string told;
  for (int i = 0; i < 100 && told.find("closed") == std::string::npos; ++i) {
    turn(1);
    told += browser.read();
  }
  EXPECT_EQ(told, "< hi >closed");
  EXPECT_EQ(server_.counters().sent, 0U);
}

TEST_F(SocketcandServerTest, ABadOpenIsAnsweredAndHungUpOn) {
  const TestClient client(server_.port());
  EXPECT_EQ(answer(client), "< hi >");
  client.send("< open nosuch >");
  EXPECT_EQ(answer(client), "< error could not open bus >");
  EXPECT_EQ(answer(client), "closed");
}

TEST_F(SocketcandServerTest, CostsNothingWithoutClients) {
  turn(0);
  test::system_calls = 0;
  for (int i = 0; i < 1'000; ++i) {
    bus_.advance(bus_.now() + milliseconds(1));
    server_.forward();
  }
  EXPECT_EQ(test::system_calls, 0);
  // Nor does a client on a quiet bus cost anything once its handshake is over.
  const TestClient client(server_.port());
  enter_rawmode(client);
  turn(0);
  test::system_calls = 0;
  for (int i = 0; i < 1'000; ++i) {
    bus_.advance(bus_.now() + milliseconds(1));
    server_.forward();
  }
  EXPECT_EQ(test::system_calls, 0);
}

/// The destination of the beacons.
class SocketcandBeaconTest : public testing::Test {
 protected:
  SocketcandBeaconTest() : listener_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    socklen_t length = sizeof address;
    EXPECT_EQ(bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), length), 0);
    EXPECT_EQ(getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &length), 0);
    port_ = ntohs(address.sin_port);
  }
  /// Returns what arrives within that time; empty if nothing does.
  std::string received(timeval limit) const {
    setsockopt(listener_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    std::array<char, 1024> buffer;
    const ssize_t size = recv(listener_.get(), buffer.data(), buffer.size(), 0);
    return size < 0 ? std::string() : std::string(buffer.data(), static_cast<std::size_t>(size));
  }

  Descriptor listener_;
  std::uint16_t port_ = 0;
  bus::CanBus rarm_{"rarm", "can_rarm"};
  bus::CanBus torso_{"torso", "can_torso"};
  std::array<bus::CanBus*, 2> buses_{&rarm_, &torso_};
};

TEST_F(SocketcandBeaconTest, TellsOfAddressAndBuses) {
  const SocketcandServer server(buses_, {.port = 0, .beacon = true, .beacon_port = port_});
  EXPECT_THAT(received({.tv_sec = 5, .tv_usec = 0}),
              testing::MatchesRegex(
                  "<CANBeacon name=\".+\" type=\"adapter\" description=\".+\">\n<URL>can://127.0.0.1:" +
                  std::to_string(server.port()) +
                  "</URL><Bus name=\"can_rarm\"/><Bus name=\"can_torso\"/></CANBeacon>"));
}

TEST_F(SocketcandBeaconTest, IsOffByDefault) {
  const SocketcandServer server(buses_, {.port = 0, .beacon_port = port_});
  EXPECT_EQ(received({.tv_sec = 0, .tv_usec = 200'000}), "");
}

TEST_F(SocketcandServerTest, OneTooManyIsTold) {
  std::vector<TestClient> clients;
  for (std::size_t i = 0; i < SocketcandServer::kMaxClients; ++i) {
    clients.emplace_back(server_.port());
    EXPECT_EQ(answer(clients.back()), "< hi >");
  }
  const TestClient refused(server_.port());
  EXPECT_EQ(answer(refused), "< error too many clients >");
  EXPECT_EQ(answer(refused), "closed");
  clients.pop_back();
  for (int i = 0; i < 10; ++i) turn(1);
  const TestClient next(server_.port());
  EXPECT_EQ(answer(next), "< hi >");
}

TEST_F(SocketcandServerTest, WrongPlacesAreRefused) {
  try {
    const SocketcandServer second(buses_, {.port = server_.port()});
    FAIL() << "the port is in use";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("127.0.0.1 port " + std::to_string(server_.port())));
    EXPECT_THAT(error.what(), HasSubstr("in use"));
  }
}

}  // namespace
}  // namespace walkman::gateways
