#include "tests/bench/vcan/child_process.h"

#include <csignal>
#include <cstdio>
#include <stdexcept>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace walkman::bench {

ChildProcess::ChildProcess(const std::function<void()>& function) : pid_(fork()) {
  if (pid_ < 0) throw std::runtime_error("no further process can be made");
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    try {
      function();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "%s\n", e.what());
    }
    _exit(1);
  }
}

ChildProcess::ChildProcess(const std::vector<std::string>& line)
    : ChildProcess([&line] {
        const int nothing = open("/dev/null", O_WRONLY);
        dup2(nothing, STDOUT_FILENO);
        std::vector<char*> words;
        for (const std::string& word : line) words.push_back(const_cast<char*>(word.c_str()));
        words.push_back(nullptr);
        execv(words[0], words.data());
        throw std::runtime_error("cannot run " + line[0]);
      }) {}

ChildProcess::~ChildProcess() {
  kill(pid_, SIGTERM);
  waitpid(pid_, nullptr, 0);
}

bool ChildProcess::running() const { return waitpid(pid_, nullptr, WNOHANG) == 0; }

}  // namespace walkman::bench
