#include "drivers/can/link_info.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/can/error_report.h"

namespace walkman::can {
namespace {

constexpr std::size_t kReplyBytes = 32768;

std::string words(int error) { return std::generic_category().message(error); }

/// One rtnetlink request and its reply.
class Request {
 public:
  Request(std::uint16_t type, std::uint16_t flags) {
    header()->nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
    header()->nlmsg_type = type;
    header()->nlmsg_flags = static_cast<std::uint16_t>(NLM_F_REQUEST | flags);
  }

  [[nodiscard]] ifinfomsg* link() { return static_cast<ifinfomsg*>(NLMSG_DATA(header())); }

  /// Adds an attribute; the place of its header, for `close`.
  std::size_t add(std::uint16_t type, const void* data, std::size_t size) {
    const std::size_t place = NLMSG_ALIGN(header()->nlmsg_len);
    auto* attribute = reinterpret_cast<rtattr*>(bytes_.data() + place);
    attribute->rta_type = type;
    attribute->rta_len = static_cast<std::uint16_t>(RTA_LENGTH(size));
    if (size > 0) std::memcpy(RTA_DATA(attribute), data, size);
    header()->nlmsg_len = static_cast<std::uint32_t>(place + RTA_ALIGN(attribute->rta_len));
    return place;
  }
  /// Everything added since `open` belongs into that attribute.
  void close(std::size_t open) {
    auto* attribute = reinterpret_cast<rtattr*>(bytes_.data() + open);
    attribute->rta_len = static_cast<std::uint16_t>(header()->nlmsg_len - open);
  }

  /// Sends it and takes the reply. 0, or the error number.
  int run(std::array<char, kReplyBytes>& reply, std::size_t& size) {
    const int descriptor = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (descriptor < 0) return errno;
    ssize_t got = send(descriptor, bytes_.data(), header()->nlmsg_len, 0);
    if (got >= 0) got = recv(descriptor, reply.data(), reply.size(), 0);
    const int error = got < 0 ? errno : 0;
    close_descriptor(descriptor);
    size = got < 0 ? 0 : static_cast<std::size_t>(got);
    return error;
  }

 private:
  static void close_descriptor(int descriptor) { ::close(descriptor); }
  nlmsghdr* header() { return reinterpret_cast<nlmsghdr*>(bytes_.data()); }

  alignas(nlmsghdr) std::array<char, 512> bytes_{};
};

template <typename Take>
void for_each_attribute(const rtattr* attribute, std::size_t size, Take take) {
  auto left = static_cast<int>(size);
  while (RTA_OK(attribute, left)) {
    const auto* bytes = reinterpret_cast<const char*>(attribute);
    take(attribute->rta_type & NLA_TYPE_MASK, bytes + RTA_LENGTH(0),
         static_cast<std::size_t>(RTA_PAYLOAD(attribute)));
    const auto step = static_cast<int>(RTA_ALIGN(attribute->rta_len));
    attribute = reinterpret_cast<const rtattr*>(bytes + step);
    left -= step;
  }
}

template <typename Value>
Value value_of(const char* data, std::size_t size) {
  Value value{};
  std::memcpy(&value, data, std::min(size, sizeof value));
  return value;
}

LinkState state_of(std::uint32_t state) {
  switch (state) {
    case CAN_STATE_ERROR_ACTIVE:
      return LinkState::kActive;
    case CAN_STATE_ERROR_WARNING:
      return LinkState::kWarning;
    case CAN_STATE_ERROR_PASSIVE:
      return LinkState::kPassive;
    case CAN_STATE_BUS_OFF:
      return LinkState::kBusOff;
    default:
      return LinkState::kDown;
  }
}

void take_can_data(LinkInfo& info, const char* data, std::size_t size) {
  for_each_attribute(reinterpret_cast<const rtattr*>(data), size,
                     [&](int type, const char* at, std::size_t n) {
                       if (type == IFLA_CAN_STATE) info.controller = state_of(value_of<std::uint32_t>(at, n));
                       if (type == IFLA_CAN_BITTIMING) info.bit_rate = value_of<can_bittiming>(at, n).bitrate;
                       if (type == IFLA_CAN_DATA_BITTIMING)
                         info.data_bit_rate = value_of<can_bittiming>(at, n).bitrate;
                       if (type == IFLA_CAN_RESTART_MS) info.restart_ms = value_of<std::uint32_t>(at, n);
                       if (type == IFLA_CAN_BERR_COUNTER) {
                         const auto counter = value_of<can_berr_counter>(at, n);
                         info.transmit_errors = counter.txerr;
                         info.receive_errors = counter.rxerr;
                       }
                     });
}

void take_link_kind(LinkInfo& info, const char* data, std::size_t size) {
  for_each_attribute(reinterpret_cast<const rtattr*>(data), size,
                     [&](int type, const char* at, std::size_t n) {
                       if (type == IFLA_INFO_KIND) info.kind = std::string(at, strnlen(at, n));
                       // The kind comes first; the data's meaning depends on it.
                       if (type == IFLA_INFO_DATA && info.kind == "can") take_can_data(info, at, n);
                     });
}

void check_name(const std::string& name) {
  if (name.empty() || name.size() >= IFNAMSIZ) {
    throw std::runtime_error(
        fmt::format("network interface \"{}\": the name has {} characters, expected 1 to {}", name,
                    name.size(), IFNAMSIZ - 1));
  }
}

int error_in(const std::array<char, kReplyBytes>& reply, std::size_t size) {
  const auto* header = reinterpret_cast<const nlmsghdr*>(reply.data());
  if (!NLMSG_OK(header, size)) return EBADMSG;
  if (header->nlmsg_type != NLMSG_ERROR) return 0;
  nlmsgerr error{};
  std::memcpy(&error, reply.data() + NLMSG_HDRLEN, std::min(sizeof error, size - NLMSG_HDRLEN));
  return -error.error;
}

}  // namespace

LinkInfo read_link_info(const std::string& name) {
  check_name(name);
  Request request(RTM_GETLINK, 0);
  request.add(IFLA_IFNAME, name.c_str(), name.size() + 1);
  alignas(nlmsghdr) std::array<char, kReplyBytes> reply{};
  std::size_t size = 0;
  int error = request.run(reply, size);
  if (error == 0) error = error_in(reply, size);
  if (error != 0) {
    throw std::runtime_error(fmt::format(
        "{}: {} ({})", name,
        error == ENODEV ? "no such network interface" : "the kernel tells nothing about it", words(error)));
  }
  LinkInfo info;
  info.name = name;
  const auto* header = reinterpret_cast<const nlmsghdr*>(reply.data());
  const auto link = value_of<ifinfomsg>(reply.data() + NLMSG_HDRLEN, size - NLMSG_HDRLEN);
  info.index = link.ifi_index;
  info.up = (link.ifi_flags & IFF_UP) != 0;
  const std::size_t start = NLMSG_LENGTH(NLMSG_ALIGN(sizeof(ifinfomsg)));
  if (header->nlmsg_len < start || header->nlmsg_len > size) return info;
  for_each_attribute(reinterpret_cast<const rtattr*>(reply.data() + start), header->nlmsg_len - start,
                     [&](int type, const char* at, std::size_t n) {
                       if (type == IFLA_MTU) info.mtu = value_of<std::uint32_t>(at, n);
                       if (type == IFLA_TXQLEN) info.queue_length = value_of<std::uint32_t>(at, n);
                       if (type == IFLA_LINKINFO) take_link_kind(info, at, n);
                     });
  return info;
}

std::string describe(const LinkInfo& info) {
  std::string text = fmt::format(
      "{}: {}, {}, {} (mtu {})", info.name, info.kind.empty() ? "network" : info.kind,
      info.up ? "up" : "down", info.carries_fd() ? "classical and FD frames" : "classical frames", info.mtu);
  if (info.bit_rate.value_or(0) != 0) {
    text += fmt::format(", {} bit/s", *info.bit_rate);
    if (info.data_bit_rate.value_or(0) != 0) text += fmt::format(" and {} bit/s", *info.data_bit_rate);
  } else {
    text += info.controller ? ", bit rate not set" : ", no bit rate (virtual)";
  }
  if (info.controller) text += fmt::format(", {}", name_of(*info.controller));
  if (info.transmit_errors) {
    text += fmt::format(", error counters {} and {}", *info.transmit_errors, *info.receive_errors);
  }
  return text;
}

BitRateReply request_bit_rate(const std::string& name, std::uint32_t bit_rate) {
  check_name(name);
  Request request(RTM_NEWLINK, NLM_F_ACK);
  request.link()->ifi_index = static_cast<int>(if_nametoindex(name.c_str()));
  if (request.link()->ifi_index == 0) return {false, name + ": no such network interface"};
  can_bittiming timing{};
  timing.bitrate = bit_rate;
  const std::size_t info = request.add(IFLA_LINKINFO, nullptr, 0);
  request.add(IFLA_INFO_KIND, "can", 3);
  const std::size_t data = request.add(IFLA_INFO_DATA, nullptr, 0);
  request.add(IFLA_CAN_BITTIMING, &timing, sizeof timing);
  request.close(data);
  request.close(info);
  alignas(nlmsghdr) std::array<char, kReplyBytes> reply{};
  std::size_t size = 0;
  int error = request.run(reply, size);
  if (error == 0) error = error_in(reply, size);
  if (error == 0) return {true, fmt::format("{}: bit rate set to {} bit/s", name, bit_rate)};
  const bool none = error == EOPNOTSUPP;
  return {false, fmt::format("{}: the kernel refuses a bit rate of {} bit/s ({}){}", name, bit_rate,
                             words(error), none ? "; a virtual interface has none and goes on without" : "")};
}

}  // namespace walkman::can
