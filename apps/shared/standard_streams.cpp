#include "apps/shared/standard_streams.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"

namespace walkman::apps {

void secure_standard_streams() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one. Opened the wrong way round, so that using it fails.
    static_cast<void>(open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
  static_cast<void>(std::signal(SIGPIPE, SIG_IGN));
  static_cast<void>(std::signal(SIGXFSZ, SIG_IGN));
}

int checked_output(int code) {
  errno = 0;
  const bool lost = std::fflush(stdout) != 0;
  if (lost || std::ferror(stdout) != 0) {
    std::fprintf(stderr, "walkman-hil: standard output: cannot be written completely%s%s%s\n",
                 errno == 0 ? "" : " (", errno == 0 ? "" : std::strerror(errno), errno == 0 ? "" : ")");
    return kEnvironment;
  }
  return code == kOk && std::ferror(stderr) != 0 ? kEnvironment : code;
}

}  // namespace walkman::apps
