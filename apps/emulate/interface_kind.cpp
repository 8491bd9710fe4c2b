#include "apps/emulate/interface_kind.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>

#include "emulator/gateways/descriptor.h"

namespace walkman::apps {
namespace {

using Bytes = std::span<const char>;

template <typename T>
T at(Bytes bytes) {
  T out;
  std::memcpy(&out, bytes.data(), sizeof out);
  return out;
}

/// What the first attribute of this type holds; empty without one (netlink(7), rtnetlink(7)).
Bytes attribute(Bytes attributes, int type) {
  while (attributes.size() >= sizeof(rtattr)) {
    const auto head = at<rtattr>(attributes);
    if (head.rta_len < sizeof head || head.rta_len > attributes.size()) break;
    if (head.rta_type == type) return attributes.subspan(sizeof head, head.rta_len - sizeof head);
    attributes = attributes.subspan(std::min<std::size_t>(RTA_ALIGN(head.rta_len), attributes.size()));
  }
  return {};
}

}  // namespace

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
    throw fail("the kernel cannot be asked about it");
  std::array<char, 32768> answer;
  const ssize_t size = recv(socket.get(), answer.data(), answer.size(), 0);
  Bytes rest(answer.data(), size < 0 ? 0 : static_cast<std::size_t>(size));
  if (rest.size() < NLMSG_LENGTH(sizeof(ifinfomsg)) || at<nlmsghdr>(rest).nlmsg_type != RTM_NEWLINK)
    throw fail("the kernel does not tell about it");
  rest = rest.subspan(NLMSG_LENGTH(sizeof(ifinfomsg)));
  const Bytes kind = attribute(attribute(rest, IFLA_LINKINFO), IFLA_INFO_KIND);
  return {kind.data(), strnlen(kind.data(), kind.size())};
}

}  // namespace walkman::apps
