#include "apps/campaign/campaign_engine.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/result_files.h"
#include "apps/shared/stop_signals.h"

namespace walkman::apps {
namespace {

constexpr int kTick = 250;  // ms

[[noreturn]] void become(const std::vector<std::string>& words, int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(kTaskFailed);  // it ended before that
  setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(arguments.front(), arguments.data());
  _exit(127);
}

std::string last_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string last;
  for (std::string line; std::getline(in, line);)
    if (!line.empty() && !line.starts_with("xargs: ") && !line.starts_with("parallel: ")) last = line;
  return last;
}

}  // namespace

EngineEnd run_engine(const std::filesystem::path& folder, const std::string& engine, int jobs,
                     const std::vector<std::size_t>& chunks, StopSignals& signals,
                     const std::function<void()>& tick) {
  const std::filesystem::path script = data_directory() / "apps" / "campaign" / "engine";
  if (access(script.c_str(), X_OK) != 0)
    throw EnvironmentError(script.string() +
                           ": cannot be run, expected the script that came with the program");
  std::string waiting;
  for (const std::size_t chunk : chunks) waiting += fmt::format("{}\n", chunk);
  write_whole(folder / "chunks.waiting", waiting);
  const std::filesystem::path log_file = folder / "engine.log";
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (log < 0) throw EnvironmentError(fmt::format("{}: {}", log_file.string(), std::strerror(errno)));
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::vector<std::string> words = {script.string(), engine, std::to_string(jobs), program,
                                          folder.string()};
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) throw EnvironmentError(fmt::format("no process for the engine: {}", std::strerror(errno)));
  if (pid == 0) become(words, log, parent);
  close(log);
  setpgid(pid, pid);
  EngineEnd end;
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    pollfd wait{signals.descriptor(), POLLIN, 0};
    poll(&wait, 1, kTick);
    if (!end.interrupted && signals.arrived()) {
      end.interrupted = true;
      kill(-pid, SIGTERM);
    }
    if (!end.interrupted) tick();
  }
  end.code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  end.said = last_line(log_file);
  return end;
}

}  // namespace walkman::apps
