#include "apps/campaign/supervised_child.h"

#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"
#include "emulator/pacing/host.h"

namespace walkman::apps {
namespace {

void require_one_thread() {
  const auto threads = std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                                     std::filesystem::directory_iterator());
  if (threads != 1)
    throw std::logic_error(fmt::format("a run cannot be forked off a process of {} threads", threads));
}

void limit_child(const ChildLimits& limits, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kTaskFailed);  // it ended before that
  const auto seconds = static_cast<rlim_t>(std::ceil(limits.cpu));
  const rlimit cpu{seconds, seconds + 5};
  setrlimit(RLIMIT_CPU, &cpu);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
}

ChildEnd end_of(int status, const ChildLimits& limits) {
  using How = ChildEnd::How;
  if (WIFEXITED(status)) {
    if (WEXITSTATUS(status) == kOk) return {How::kClean, ""};
    if (WEXITSTATUS(status) == kEnvironment) return {How::kLacking, ""};
    return {How::kCrashed, fmt::format("exit code {}", WEXITSTATUS(status))};
  }
  const int signal = WTERMSIG(status);
  const std::string text = fmt::format("signal {} ({})", signal, strsignal(signal));
  switch (signal) {
    case SIGXCPU:
      return {How::kHung, fmt::format("no end within {:g} s of CPU time", limits.cpu)};
    case SIGKILL:
      return {How::kKilled, text};
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
      return {How::kEndedFrom, text};
    default:
      return {How::kCrashed, text};
  }
}

/// Waits until the child has closed its end of the pipe, which it does by ending. Returns false at the limit.
bool closed_in_time(int pipe_end, double wall) {
  const Time until = pacing::host_now() + Time(static_cast<std::int64_t>(wall * 1e9));
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - pacing::host_now());
    pollfd wait{pipe_end, POLLIN, 0};
    const int ready = poll(&wait, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;
  }
}

}  // namespace

bool fork_and_wait(const ChildLimits& limits, ChildEnd& end) {
  require_one_thread();
  int ends[2];
  if (pipe(ends) != 0) throw EnvironmentError(fmt::format("no pipe for a run: {}", std::strerror(errno)));
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) throw EnvironmentError(fmt::format("no process for a run: {}", std::strerror(errno)));
  if (pid == 0) {
    close(ends[0]);
    limit_child(limits, parent);
    return true;
  }
  close(ends[1]);
  const bool in_time = closed_in_time(ends[0], limits.wall);
  close(ends[0]);
  if (!in_time) kill(pid, SIGKILL);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  end = in_time ? end_of(status, limits)
                : ChildEnd{ChildEnd::How::kHung, fmt::format("no end within {:g} s", limits.wall)};
  return false;
}

}  // namespace walkman::apps
