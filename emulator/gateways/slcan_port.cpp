#include "emulator/gateways/slcan_port.h"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/stat.h>
#include <termios.h>

namespace walkman::gateways {

namespace {

constexpr int kReadsAtOnce = 16;

[[noreturn]] void fail(const bus::CanBus& bus, const std::string& reason) {
  throw std::runtime_error("slcan port of bus '" + bus.name() + "': " + reason);
}

/// Removes a link of this user to a pseudo-terminal that no longer exists, or whose number `terminal` now
/// has. Throws if something else is in the way.
void clear_the_way(const bus::CanBus& bus, const std::filesystem::path& link, const std::string& terminal) {
  struct stat there {};
  if (lstat(link.c_str(), &there) != 0) return;  // nothing there, or creating the link reports why
  if (!S_ISLNK(there.st_mode)) fail(bus, link.string() + " exists and is not a symbolic link");
  std::error_code error;
  const std::string target = std::filesystem::read_symlink(link, error).string();
  if (!target.starts_with("/dev/pts/") || there.st_uid != geteuid()) {
    fail(bus,
         link.string() + " is a symbolic link to " + target + ", not created by an emulator of this user");
  }
  if (target != terminal && std::filesystem::exists(target, error)) {
    fail(bus, link.string() + " links to " + target + ", which is in use by another program");
  }
  if (unlink(link.c_str()) != 0) {
    fail(bus, "cannot remove the symbolic link " + link.string() + " left behind: " + std::strerror(errno));
  }
}

}  // namespace

SlcanPort::SlcanPort(bus::CanBus& bus, const std::filesystem::path& link)
    : adapter_(bus),
      master_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  std::array<char, 64> name{};
  termios settings{};
  if (!master_.valid() || !epoll_.valid() || grantpt(master_.get()) != 0 || unlockpt(master_.get()) != 0 ||
      ptsname_r(master_.get(), name.data(), name.size()) != 0 || tcgetattr(master_.get(), &settings) != 0) {
    fail(bus, std::string("no pseudo-terminal: ") + std::strerror(errno));
  }
  // No echo and no line editing, for tools that do not ask for it themselves.
  cfmakeraw(&settings);
  if (tcsetattr(master_.get(), TCSANOW, &settings) != 0) fail(bus, std::strerror(errno));
  terminal_ = name.data();
  // Edge-triggered: a terminal that nobody has open permanently reports a hang-up.
  watched_ = EPOLLIN | EPOLLET;
  epoll_event event{.events = watched_, .data = {.ptr = nullptr}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, master_.get(), &event) != 0) fail(bus, std::strerror(errno));
  if (!link.empty()) place_link(bus, link);
}

void SlcanPort::place_link(const bus::CanBus& bus, const std::filesystem::path& link) {
  const FolderLock lock(link);
  clear_the_way(bus, link, terminal_);
  std::error_code error;
  std::filesystem::create_symlink(terminal_, link, error);
  if (error) fail(bus, "cannot create the symbolic link " + link.string() + ": " + error.message());
  link_ = OwnedPath(link);
}

void SlcanPort::service() noexcept {
  epoll_event event;
  static_cast<void>(epoll_wait(epoll_.get(), &event, 1, 0));
  write();
  read();
  forward();
}

void SlcanPort::forward() noexcept {
  adapter_.forward();
  write();
  watch();
}

void SlcanPort::read() noexcept {
  std::array<char, 4096> buffer;
  for (int reads = 0; reads < kReadsAtOnce; ++reads) {
    const ssize_t size = ::read(master_.get(), buffer.data(), buffer.size());
    if (size <= 0) {
      if (size < 0 && errno == EIO && attached_) hung_up();
      return;
    }
    attached_ = true;
    adapter_.take({buffer.data(), static_cast<std::size_t>(size)});
  }
  watched_ = 0;  // there may be more: `watch` asks for another event
}

void SlcanPort::hung_up() noexcept {
  attached_ = false;
  adapter_.reset();
  // What the peer has not read must not be the first thing the next one reads.
  const Descriptor terminal(::open(terminal_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (terminal.valid()) tcflush(terminal.get(), TCIFLUSH);
}

void SlcanPort::write() noexcept {
  TextQueue& outgoing = adapter_.outgoing();
  while (!outgoing.empty()) {
    const std::string_view text = outgoing.text();
    const ssize_t size = ::write(master_.get(), text.data(), text.size());
    if (size > 0) {
      outgoing.pop(static_cast<std::size_t>(size));
    } else if (size == 0 || errno != EINTR) {
      return;
    }
  }
}

void SlcanPort::watch() noexcept {
  std::uint32_t wanted = EPOLLIN | EPOLLET;
  if (!adapter_.outgoing().empty()) wanted |= EPOLLOUT;
  if (wanted == watched_) return;
  watched_ = wanted;
  epoll_event event{.events = wanted, .data = {.ptr = nullptr}};
  static_cast<void>(epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, master_.get(), &event));
}

}  // namespace walkman::gateways
