#include "apps/experiment/result_folder.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"
#include "apps/shared/result_files.h"

namespace walkman::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLockName = ".lock";
constexpr const char* kResultName = "result.json";
constexpr const char* kRepetitionPrefix = "repetition-";
constexpr const char* kSeriesInputs = "inputs.txt";
constexpr const char* kSheetsName = "dbc";
constexpr std::array kFiles = {kResultName,  "can.log",          "cloud.pcd", "seen.png",   "held.png",
                               "wrench.csv", "model_error.yaml", "state.csv", kSeriesInputs};

void remove_files(const fs::path& folder) {
  for (const char* name : kFiles) {
    fs::remove(folder / name);
    fs::remove(partial(folder / name));
  }
  for (const fs::path& sheets : {folder / kSheetsName, partial(folder / kSheetsName)}) {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(sheets, none)) {
      if (entry.path().extension() == ".dbc") fs::remove(entry.path());
    }
    fs::remove(sheets, none);  // unless something else is in it
  }
}

bool is_repetition(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  return entry.is_directory() && !entry.is_symlink() && name.starts_with(kRepetitionPrefix) &&
         name.find_first_not_of("0123456789", std::strlen(kRepetitionPrefix)) == std::string::npos;
}

std::string holder(const fs::path& lock) {
  std::string text;
  std::getline(std::ifstream(lock), text);
  return text.empty() ? "another run" : "process " + text;
}

}  // namespace

ResultFolder::ResultFolder(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!fs::is_directory(folder_)) {
    throw EnvironmentError(fmt::format("--out {}: the folder cannot be created ({})", folder_.string(),
                                       error ? error.message() : "something else has this name"));
  }
  const fs::path lock = folder_ / kLockName;
  lock_ = open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (lock_ < 0) {
    throw EnvironmentError(
        fmt::format("--out {}: nothing can be written there ({})", folder_.string(), std::strerror(errno)));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    const int reason = errno;
    close(lock_);
    throw EnvironmentError(
        reason == EWOULDBLOCK
            ? fmt::format("--out {}: in use by {}, expected a folder of this run's own", folder_.string(),
                          holder(lock))
            : fmt::format("--out {}: cannot be locked ({})", folder_.string(), std::strerror(reason)));
  }
  const std::string me = std::to_string(getpid()) + "\n";
  // Only for the message that refuses another run: the lock itself needs no content.
  if (ftruncate(lock_, 0) == 0) static_cast<void>(!write(lock_, me.data(), me.size()));
}

ResultFolder::~ResultFolder() {
  // So that the folder is the same from run to run, byte for byte.
  static_cast<void>(ftruncate(lock_, 0) == 0);
  close(lock_);
}

void ResultFolder::clear() const {
  try {
    remove_files(folder_);
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (!is_repetition(entry)) continue;
      remove_files(entry.path());
      std::error_code none;
      fs::remove(entry.path(), none);
    }
  } catch (const fs::filesystem_error& e) {
    throw EnvironmentError(fmt::format("{}: left by an earlier run, cannot be removed ({})",
                                       e.path1().string(), e.code().message()));
  }
}

fs::path ResultFolder::of_repetition(int index) const {
  return index == 0 ? folder_ : folder_ / fmt::format("{}{:02}", kRepetitionPrefix, index + 1);
}

void ResultFolder::write_result(std::string_view json) const { write_whole(folder_ / kResultName, json); }

std::vector<std::string> complete_files(const fs::path& folder) {
  std::vector<std::string> out;
  for (const char* name : kFiles)
    if (name != kSeriesInputs && fs::exists(folder / name)) out.emplace_back(name);
  if (fs::exists(folder / kSheetsName)) out.emplace_back(kSheetsName);
  return out;
}

}  // namespace walkman::apps
