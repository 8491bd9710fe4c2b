#include "emulator/gateways/paced_outbox.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <utility>

#include <netinet/in.h>
#include <sys/socket.h>

#include "emulator/pacing/host.h"

namespace walkman::gateways {
namespace {

// What waits for a client is sent within 40 ms, and there is at most one frame in 67 ms: 1.5 MB of
// disparities at 38 kB per millisecond. A client that reads every 5 ms then finds 190 kB; a kernel with the
// usual net.core.rmem_max of 212992 bytes keeps up to 224 kB of large datagrams for it. A client that
// requests the images, too, must read more often, as with the real camera.
constexpr std::size_t kBursts = 40;
constexpr std::size_t kLeastBurst = 25000;  // bytes
constexpr Time kInterval = std::chrono::milliseconds(1);

}  // namespace

PacedOutbox::PacedOutbox(int socket, std::function<void()> drained)
    : socket_(socket), drained_(std::move(drained)), thread_([this] { work(); }) {}

PacedOutbox::~PacedOutbox() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  filled_.notify_one();
  thread_.join();
}

void PacedOutbox::push(Address to, std::vector<std::uint8_t> datagram) {
  {
    const std::lock_guard lock(mutex_);
    Queue& queue = queues_[to];
    queue.bytes += datagram.size();
    queue.burst = std::max({queue.burst, kLeastBurst, queue.bytes / kBursts});
    waiting_ += datagram.size();
    was_full_ = was_full_ || full();
    queue.datagrams.push_back(std::move(datagram));
  }
  filled_.notify_one();
}

void PacedOutbox::drop(Address to) {
  const std::lock_guard lock(mutex_);
  const auto found = queues_.find(to);
  if (found == queues_.end()) return;
  waiting_ -= found->second.bytes;
  queues_.erase(found);
}

void PacedOutbox::work() {
  pacing::stay_behind();  // the control loop goes first
  Time next = pacing::host_now();
  while (true) {
    bool room = false;
    {
      std::unique_lock lock(mutex_);
      filled_.wait(lock, [this] { return stop_ || !queues_.empty(); });
      if (stop_) return;
      send_bursts();
      room = waiting_ < kMost / 2 && std::exchange(was_full_, false);
    }
    if (room) drained_();
    next = std::max(next + kInterval, pacing::host_now());
    pacing::pause_until(next);
  }
}

void PacedOutbox::send_bursts() {
  for (auto entry = queues_.begin(); entry != queues_.end();) {
    Queue& queue = entry->second;
    for (std::size_t sent = 0; sent < queue.burst && !queue.datagrams.empty();) {
      const std::vector<std::uint8_t>& first = queue.datagrams.front();
      if (!send(entry->first, first)) return;
      sent += first.size();
      queue.bytes -= first.size();
      waiting_ -= first.size();
      queue.datagrams.pop_front();
    }
    entry = queue.datagrams.empty() ? queues_.erase(entry) : std::next(entry);
  }
}

bool PacedOutbox::send(Address to, const std::vector<std::uint8_t>& datagram) const {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(static_cast<std::uint32_t>(to >> 16U));
  address.sin_port = htons(static_cast<std::uint16_t>(to));
  const auto try_it = [&] {
    return sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                  sizeof address) >= 0;
  };
  if (try_it()) return true;
  if (errno == ECONNREFUSED && try_it()) return true;  // the error was another client's, reported here
  return errno != EAGAIN && errno != ENOBUFS;
}

}  // namespace walkman::gateways
