#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace walkman::apps {

/// The folder that one run of an experiment writes to, and no other run at the same time. The first
/// repetition's files are in it, the others' in separate subfolders.
class ResultFolder {
 public:
  /// Creates the folder if necessary and locks it. Throws EnvironmentError if that fails, or if another run
  /// has locked it, naming that run's process.
  explicit ResultFolder(std::filesystem::path folder);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Removes the files of an earlier run, complete and partial, and nothing else. Throws EnvironmentError.
  void clear() const;

  /// Folder for a repetition's files; `index` from 0.
  [[nodiscard]] std::filesystem::path of_repetition(int index) const;

  /// Replaces `result.json` as a whole. Throws EnvironmentError.
  void write_result(std::string_view json) const;

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
  int lock_ = -1;  // inherited by the repetitions' processes: held until the last of them has ended
};

/// Names of the files of one repetition that are in the folder and complete, for users.
[[nodiscard]] std::vector<std::string> complete_files(const std::filesystem::path& folder);

}  // namespace walkman::apps
