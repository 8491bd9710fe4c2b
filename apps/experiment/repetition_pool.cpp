#include "apps/experiment/repetition_pool.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/experiment/result_report.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/stop_signals.h"
#include "emulator/pacing/host.h"

namespace walkman::apps {
namespace {

constexpr auto kProgressInterval = std::chrono::milliseconds(200);

struct Child {
  std::size_t index;
  pid_t pid;
  int pipe;
  std::string received;
};

void write_line(int pipe, const nlohmann::json& message) {
  // A sentence may name a path with bytes that are not UTF-8.
  const std::string line = message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t n = write(pipe, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) _exit(5);  // the parent is gone
    done += static_cast<std::size_t>(n);
  }
}

/// Body of the child process: runs one repetition and sends its messages as JSON lines.
[[noreturn]] void run_child(const RepetitionOptions& options, int pipe) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // otherwise a child of a killed parent would go on writing
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  RepetitionOptions own = options;
  Time last = pacing::host_now() - kProgressInterval;
  own.progress = [&](const Progress& p) {
    const Time now = pacing::host_now();
    if (now - last < kProgressInterval) return;
    last = now;
    write_line(pipe, {{"phase", p.phase}, {"time", p.simulated_seconds}, {"rtf", p.real_time_factor}});
  };
  own.warned = [&](std::string_view sentence) { write_line(pipe, {{"warning", sentence}}); };
  try {
    write_line(pipe, {{"result", to_json(run_repetition(own))}});
  } catch (const EnvironmentError& e) {
    write_line(pipe, {{"environment", e.what()}});
  } catch (const std::runtime_error& e) {
    write_line(pipe, {{"error", e.what()}});
  } catch (const std::exception& e) {
    write_line(pipe, {{"defect", e.what()}});
  }
  _exit(0);
}

Child start(std::size_t index, const RepetitionOptions& options) {
  int ends[2];
  if (pipe(ends) != 0)
    throw std::runtime_error(fmt::format("no pipe for a repetition: {}", std::strerror(errno)));
  const pid_t pid = fork();
  if (pid < 0) throw std::runtime_error(fmt::format("no process for a repetition: {}", std::strerror(errno)));
  if (pid == 0) {
    close(ends[0]);
    run_child(options, ends[1]);
  }
  close(ends[1]);
  return {index, pid, ends[0], {}};
}

/// Takes complete lines out of the data received from a child.
void take_messages(Child& child, std::optional<RepetitionResult>& result, const PoolEvents& events) {
  std::size_t end = 0;
  while ((end = child.received.find('\n')) != std::string::npos) {
    const auto message = nlohmann::json::parse(child.received.substr(0, end));
    child.received.erase(0, end + 1);
    if (message.contains("error")) throw std::runtime_error(message["error"].get<std::string>());
    if (message.contains("environment")) throw EnvironmentError(message["environment"].get<std::string>());
    if (message.contains("defect")) throw std::logic_error(message["defect"].get<std::string>());
    if (message.contains("result")) {
      result = repetition_from_json(message["result"]);
      if (events.completed) events.completed(child.index, *result);
    } else if (message.contains("warning")) {
      if (events.warned) events.warned(child.index, message["warning"].get<std::string>());
    } else if (events.progress) {
      events.progress(child.index, {message["phase"].get<std::string>(), message["time"].get<double>(),
                                    message["rtf"].get<double>()});
    }
  }
}

/// Reads once from a child. Returns false when it has closed its end.
bool read_from(Child& child) {
  char buffer[4096];
  const ssize_t n = read(child.pipe, buffer, sizeof buffer);
  if (n > 0) child.received.append(buffer, static_cast<std::size_t>(n));
  return n > 0 || (n < 0 && errno == EINTR);
}

/// Children that have not been waited for yet; kills the remaining ones when destroyed.
class Children {
 public:
  Children() = default;
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;
  ~Children() { end_all(); }

  void end_all() {
    for (const Child& child : running) {
      kill(child.pid, SIGKILL);
      waitpid(child.pid, nullptr, 0);
      close(child.pipe);
    }
    running.clear();
  }

  std::vector<Child> running;
};

}  // namespace

std::vector<std::optional<RepetitionResult>> run_repetitions(
    const std::vector<RepetitionOptions>& repetitions, int jobs, const PoolEvents& events,
    StopSignals* signals) {
  std::vector<std::optional<RepetitionResult>> results(repetitions.size());
  Children children;
  std::vector<Child>& running = children.running;
  std::exception_ptr error;
  std::size_t next = 0;
  while (!running.empty() || (next < repetitions.size() && !error)) {
    while (!error && next < repetitions.size() && static_cast<int>(running.size()) < jobs) {
      running.push_back(start(next, repetitions[next]));
      ++next;
    }
    std::vector<pollfd> waits;
    waits.reserve(running.size() + 1);
    for (const Child& child : running) waits.push_back({child.pipe, POLLIN, 0});
    waits.push_back({signals == nullptr ? -1 : signals->descriptor(), POLLIN, 0});
    if (poll(waits.data(), waits.size(), -1) < 0 && errno != EINTR) break;
    if (signals != nullptr && signals->arrived()) return results;
    for (std::size_t i = running.size(); i-- > 0;) {
      if ((waits[i].revents & (POLLIN | POLLHUP)) == 0) continue;
      Child& child = running[i];
      const bool open = read_from(child);
      try {
        take_messages(child, results[child.index], events);
      } catch (const std::exception&) {
        if (!error) error = std::current_exception();
      }
      if (open) continue;
      int status = 0;
      waitpid(child.pid, &status, 0);
      close(child.pipe);
      if (!error && WIFSIGNALED(status)) {
        error = std::make_exception_ptr(std::logic_error(
            fmt::format("repetition {} was killed by signal {}", child.index + 1, WTERMSIG(status))));
      }
      if (!error && !results[child.index]) {
        error = std::make_exception_ptr(
            std::logic_error(fmt::format("repetition {} ended without a result", child.index + 1)));
      }
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  if (error) std::rethrow_exception(error);
  return results;
}

}  // namespace walkman::apps
