#pragma once

#include <filesystem>
#include <string_view>

namespace walkman::apps {

/// The folder that one run of an experiment writes to, and no other run meanwhile. The first repetition's
/// files lie in it, the others' in folders of their own.
class ResultFolder {
 public:
  /// Makes the folder if it is not there and locks it. Throws EnvironmentError when that cannot be done, or
  /// when another run has it, naming that run's process.
  explicit ResultFolder(std::filesystem::path folder);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Removes what an earlier run has left, whole and partial files, and nothing else. Throws
  /// EnvironmentError.
  void clear() const;

  /// Where a repetition's files are to lie; `index` from 0.
  [[nodiscard]] std::filesystem::path of_repetition(int index) const;

  /// Replaces `result.json` as a whole. Throws EnvironmentError.
  void write_result(std::string_view json) const;

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
  int lock_ = -1;  // inherited by the repetitions' processes: held until the last of them has ended
};

}  // namespace walkman::apps
