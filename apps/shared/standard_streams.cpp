#include "apps/shared/standard_streams.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {

void secure_standard_streams() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one. Opened for the wrong direction, so that using it fails.
    static_cast<void>(open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
  static_cast<void>(std::signal(SIGPIPE, SIG_IGN));
  static_cast<void>(std::signal(SIGXFSZ, SIG_IGN));
}

void print(std::string_view text) { std::fputs(printable(text).c_str(), stdout); }

void print_json(std::string_view document) {
  // The library escapes control characters below space; `printable` escapes the others as JSON does, except
  // for this one.
  std::string text;
  for (const char c : document) c == '\x7F' ? text += "\\u007F" : text += c;
  print(text);
}

void print_to_stderr(std::string_view text) { std::fputs(printable(text).c_str(), stderr); }

void say(std::string_view sentence) { print_to_stderr("walkman-hil: " + one_line(sentence) + '\n'); }

int checked_output(int code) {
  errno = 0;
  const bool lost = std::fflush(stdout) != 0;
  if (lost || std::ferror(stdout) != 0) {
    say(fmt::format("standard output: cannot be written completely{}",
                    errno == 0 ? "" : fmt::format(" ({})", std::strerror(errno))));
    return kEnvironment;
  }
  return code == kOk && std::ferror(stderr) != 0 ? kEnvironment : code;
}

}  // namespace walkman::apps
