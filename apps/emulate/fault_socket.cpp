#include "apps/emulate/fault_socket.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <span>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::apps {
namespace {

using Bytes = std::span<const char>;

template <typename T>
T at(Bytes bytes) {
  T out;
  std::memcpy(&out, bytes.data(), sizeof out);
  return out;
}

/// Returns the payload of the first attribute of this type; empty without one (netlink(7), rtnetlink(7)).
Bytes attribute(Bytes attributes, int type) {
  while (attributes.size() >= sizeof(rtattr)) {
    const auto head = at<rtattr>(attributes);
    if (head.rta_len < sizeof head || head.rta_len > attributes.size()) break;
    if (head.rta_type == type) return attributes.subspan(sizeof head, head.rta_len - sizeof head);
    attributes = attributes.subspan(std::min<std::size_t>(RTA_ALIGN(head.rta_len), attributes.size()));
  }
  return {};
}

/// Kind of a network interface as named by the driver that created it (IFLA_INFO_KIND): "vcan" or "vxcan" for
/// CAN buses without a wire, "can" for controllers and serial adapters; empty if the driver has no name for
/// it.
std::string interface_kind(const std::string& name) {
  const auto fail = [&](const char* what) -> std::runtime_error {
    return std::runtime_error(fmt::format("{}: {}: {}", name, what, std::generic_category().message(errno)));
  };
  struct {
    nlmsghdr head{};
    ifinfomsg link{};
  } request;
  request.head.nlmsg_len = sizeof request;
  request.head.nlmsg_type = RTM_GETLINK;
  request.head.nlmsg_flags = NLM_F_REQUEST;
  request.link.ifi_family = AF_UNSPEC;
  request.link.ifi_index = static_cast<int>(if_nametoindex(name.c_str()));
  if (request.link.ifi_index == 0) throw fail("no such interface");

  const gateways::Descriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  if (socket.get() < 0 || send(socket.get(), &request, sizeof request, 0) != sizeof request)
    throw fail("the kernel cannot be queried about it");
  std::array<char, 32768> answer;
  const ssize_t size = recv(socket.get(), answer.data(), answer.size(), 0);
  Bytes rest(answer.data(), size < 0 ? 0 : static_cast<std::size_t>(size));
  if (rest.size() < NLMSG_LENGTH(sizeof(ifinfomsg)) || at<nlmsghdr>(rest).nlmsg_type != RTM_NEWLINK)
    throw fail("the kernel does not describe it");
  rest = rest.subspan(NLMSG_LENGTH(sizeof(ifinfomsg)));
  const Bytes kind = attribute(attribute(rest, IFLA_LINKINFO), IFLA_INFO_KIND);
  return {kind.data(), strnlen(kind.data(), kind.size())};
}

constexpr std::size_t kLongest = 8192;           // bytes of a request
constexpr std::size_t kLongestAnswer = 1 << 16;  // bytes
constexpr int kAnswerMs = 2000;
constexpr std::string_view kOkay = "ok\n", kError = "error\n";
constexpr std::array<const char*, 3> kStages = {"waiting", "active", "over"};

sockaddr_un address_of(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.size() >= sizeof address.sun_path)
    throw std::runtime_error(fmt::format("{}: {} bytes, expected a socket name of at most {}", text,
                                         text.size(), sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, text.c_str(), text.size());
  return address;
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

std::string states_json(const std::vector<faults::InjectionState>& states) {
  nlohmann::json out = nlohmann::json::array();
  for (const faults::InjectionState& state : states)
    out.push_back({{"name", state.injection.name},
                   {"fault", state.injection.kind->name},
                   {"target", state.injection.target},
                   {"stage", kStages[static_cast<std::size_t>(state.stage)]},
                   {"times", state.times},
                   {"frames", state.touched}});
  return nlohmann::json{{"active", out}}.dump(2);
}

}  // namespace

std::filesystem::path default_fault_socket() {
  const char* const folder = std::getenv("XDG_RUNTIME_DIR");
  if (folder != nullptr && *folder != '\0') return std::filesystem::path(folder) / "walkman-hil.faults";
  return fmt::format("/tmp/walkman-hil-{}.faults", getuid());
}

FaultSocket::FaultSocket(Emulation& emulation, const std::filesystem::path& path) : emulation_(emulation) {
  const gateways::FolderLock lock(path);
  const sockaddr_un address = address_of(path);
  socket_ = gateways::Descriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const auto* const named = reinterpret_cast<const sockaddr*>(&address);
  struct stat there {};
  if (lstat(address.sun_path, &there) == 0 && !S_ISSOCK(there.st_mode))
    throw EnvironmentError(
        fmt::format("--fault-socket {}: exists and is not a socket, expected a new name", path.string()));
  // A socket left behind by an emulator that is gone refuses connections.
  if (connect(socket_.get(), named, sizeof address) != 0 && errno == ECONNREFUSED) unlink(address.sun_path);
  socket_ = gateways::Descriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const mode_t before = umask(S_IXUSR | S_IRWXG | S_IRWXO);  // accessible to its owner only
  const int bound = bind(socket_.get(), named, sizeof address);
  const int error = errno;
  umask(before);
  if (bound != 0)
    throw EnvironmentError(fmt::format("--fault-socket {}: {}", path.string(), std::strerror(error)));
  path_ = gateways::OwnedPath(path);
  emulation.attach(
      socket_.get(), [this] { service(); }, [] {});
}

void FaultSocket::service() {
  std::array<char, kLongest> request{};
  sockaddr_un from{};
  for (;;) {
    socklen_t size = sizeof from;
    const ssize_t bytes =
        recvfrom(socket_.get(), request.data(), request.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (bytes < 0) return;
    std::string text;
    try {
      text = std::string(kOkay) + answer(lines_of({request.data(), static_cast<std::size_t>(bytes)}));
      if (text.size() > kLongestAnswer)
        throw std::runtime_error(fmt::format("the answer has {} bytes, at most {} can be sent: clear faults",
                                             text.size(), kLongestAnswer));
    } catch (const std::runtime_error& e) {
      text = std::string(kError) + e.what();
    }
    if (size <= sizeof from.sun_family) continue;  // nobody to answer to
    static_cast<void>(
        sendto(socket_.get(), text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&from), size));
  }
}

std::string FaultSocket::answer(const std::vector<std::string>& request) {
  Emulator& emulator = emulation_.emulator();
  if (request.empty()) throw std::runtime_error("an empty request, expected inject, clear or active");
  const std::vector<std::string> words(request.begin() + 1, request.end());
  if (request.front() == "inject") {
    const faults::Injection injection = faults::parse_fault(words);
    faults::require_of_emulator(injection);
    emulator.inject(injection);
    say(fmt::format("fault injected: {}", fmt::join(words, " ")));
    return injection.name;
  }
  if (request.front() == "clear") {
    std::vector<std::string> names = words;
    if (names == std::vector<std::string>{"all"}) {
      names.clear();
      for (const faults::InjectionState& state : emulator.injections()) names.push_back(state.injection.name);
    }
    for (const std::string& name : names) {
      if (!emulator.clear_fault(name))
        throw std::runtime_error(fmt::format("there is no fault \"{}\"", name));
      say(fmt::format("fault cleared: {}", name));
    }
    return fmt::format("{} cleared", names.size());
  }
  if (request.front() == "active") return states_json(emulator.injections());
  throw std::runtime_error(fmt::format("\"{}\", expected inject, clear or active", request.front()));
}

std::string ask_emulator(const std::filesystem::path& path, const std::vector<std::string>& request) {
  const sockaddr_un address = address_of(path);
  const gateways::Descriptor client(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_un own{};
  own.sun_family = AF_UNIX;
  const std::string text = fmt::format("{}", fmt::join(request, "\n"));
  const auto nobody = [&](const char* why) {
    return EnvironmentError(
        fmt::format("{}: {}; expected an emulator that was started with --fault-socket", path.string(), why));
  };
  // The client needs an address to receive the answer: the kernel assigns one.
  if (!client.valid() ||
      bind(client.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own.sun_family) != 0 ||
      connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      send(client.get(), text.data(), text.size(), 0) < 0)
    throw nobody(std::strerror(errno));
  pollfd ready{client.get(), POLLIN, 0};
  if (poll(&ready, 1, kAnswerMs) != 1) throw nobody("no answer in 2 s");
  std::string answer(kLongestAnswer, '\0');
  const ssize_t bytes = recv(client.get(), answer.data(), answer.size(), 0);
  if (bytes < 0) throw nobody(std::strerror(errno));
  answer.resize(static_cast<std::size_t>(bytes));
  if (answer.starts_with(kOkay)) return answer.substr(kOkay.size());
  throw std::runtime_error(answer.substr(std::min(answer.size(), kError.size())));
}

void require_virtual(const Emulation& emulation) {
  for (const BusSummary& bus : emulation.summary().buses) {
    if (bus.interface_name.empty()) continue;
    const std::string kind = interface_kind(bus.interface_name);
    if (kind == "vcan" || kind == "vxcan") continue;
    throw std::runtime_error(fmt::format(
        "--can {}={}: an interface of kind \"{}\", expected vcan or vxcan to inject faults on, or "
        "--faults-on-hardware",
        bus.name, bus.interface_name, kind));
  }
}

}  // namespace walkman::apps
