// Emulated nodes on two buses in real time, with every gateway open, to which the gateway tests attach
// foreign tools. Usage: gateway_harness SLCAN_LINK. Prints "ready PORT" and runs until its standard input
// ends.
#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

#include <poll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "emulator/gateways/slcan_port.h"
#include "emulator/gateways/socketcand_server.h"
#include "tests/unit/nodes/test_drive.h"

namespace {

using namespace walkman;

constexpr Time kCycle = std::chrono::milliseconds(1);

/// Stationary drives on one bus.
class Limb {
 public:
  Limb(const char* name, const char* interface_name, std::uint8_t first_node, int count)
      : bus(name, interface_name) {
    for (int i = 0; i < count; ++i) {
      drives_.push_back(
          std::make_unique<nodes::DriveNode>(nodes::test_drive(static_cast<std::uint8_t>(first_node + i))));
      bus.attach(*drives_.back());
    }
  }
  void advance() {
    for (const auto& drive : drives_) drive->control({}, std::chrono::duration<double>(kCycle).count());
    bus.advance(bus.now() + kCycle);
  }

  bus::CanBus bus;

 private:
  std::vector<std::unique_ptr<nodes::DriveNode>> drives_;
};

int run(const char* link) {
  Limb rarm("rarm", "can_rarm", 11, 7);
  Limb larm("larm", "can_larm", 20, 3);
  std::array<bus::CanBus*, 2> buses{&rarm.bus, &larm.bus};
  gateways::SocketcandServer server(buses, {.port = 0});
  gateways::SlcanPort slcan(rarm.bus, link);

  const gateways::Descriptor timer(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
  const itimerspec period{.it_interval = {0, kCycle.count()}, .it_value = {0, kCycle.count()}};
  timerfd_settime(timer.get(), 0, &period, nullptr);
  std::printf("ready %u\n", static_cast<unsigned>(server.port()));
  std::fflush(stdout);

  std::array<pollfd, 4> waits{{{STDIN_FILENO, POLLIN, 0},
                               {timer.get(), POLLIN, 0},
                               {server.descriptor(), POLLIN, 0},
                               {slcan.descriptor(), POLLIN, 0}}};
  for (;;) {
    if (poll(waits.data(), waits.size(), -1) < 0) return 1;
    if (waits[0].revents != 0) break;
    if ((waits[1].revents & POLLIN) != 0) {
      std::uint64_t cycles = 0;
      if (read(timer.get(), &cycles, sizeof cycles) != sizeof cycles) return 1;
      for (; cycles > 0; --cycles) {
        rarm.advance();
        larm.advance();
        server.forward();
        slcan.forward();
      }
    }
    server.service();
    slcan.service();
  }
  const auto& counters = server.counters();
  std::printf(
      "sent %llu received %llu dropped %llu errors %llu\n", static_cast<unsigned long long>(counters.sent),
      static_cast<unsigned long long>(counters.received), static_cast<unsigned long long>(counters.dropped),
      static_cast<unsigned long long>(counters.errors));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: gateway_harness SLCAN_LINK\n");
    return 2;
  }
  try {
    return run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gateway_harness: %s\n", error.what());
    return 1;
  }
}
