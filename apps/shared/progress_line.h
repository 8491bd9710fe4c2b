#pragma once

#include <string>

namespace walkman::apps {

/// One line on stderr that is written over and over while work goes on; nothing when stderr is not a
/// terminal.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const std::string& text);
  /// Takes it away, for other output in its place.
  void clear();

 private:
  bool terminal_;
  bool shown_ = false;
};

}  // namespace walkman::apps
