#include "apps/shared/stop_signals.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <string>

#include <sys/signalfd.h>
#include <unistd.h>

namespace walkman::apps {

StopSignals::StopSignals() : descriptor_(-1) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  descriptor_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  if (descriptor_ < 0) {
    throw std::runtime_error(std::string("cannot wait for signals (") + std::strerror(errno) + ")");
  }
}

StopSignals::~StopSignals() { close(descriptor_); }

bool StopSignals::arrived() noexcept {
  signalfd_siginfo info{};
  if (!arrived_) arrived_ = read(descriptor_, &info, sizeof info) == sizeof info;
  return arrived_;
}

}  // namespace walkman::apps
