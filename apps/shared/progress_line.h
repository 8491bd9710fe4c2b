#pragma once

#include <string>

namespace walkman::apps {

/// A line on stderr that is overwritten again and again while work goes on; no output if stderr is not a
/// terminal.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const std::string& text);
  /// Removes the line, for other output in its place.
  void clear();

 private:
  bool terminal_;
  bool shown_ = false;
};

}  // namespace walkman::apps
