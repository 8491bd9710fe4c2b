#include "apps/shared/progress_line.h"

#include <cstdio>

#include <unistd.h>

#include "urdf/reader/utf8.h"

namespace walkman::apps {

ProgressLine::ProgressLine() : terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void ProgressLine::show(const std::string& text) {
  if (!terminal_) return;
  std::fprintf(stderr, "\r\033[K%s", one_line(text).c_str());
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace walkman::apps
