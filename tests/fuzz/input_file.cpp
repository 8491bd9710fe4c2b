#include "tests/fuzz/input_file.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "tests/fuzz/input.h"

namespace walkman::fuzz {
namespace fs = std::filesystem;

InputFile::InputFile(const fs::path& name, const fs::path& beside) {
  // In memory if there is such a file system: an input is written ten thousand times a second.
  std::error_code none;
  const fs::path root = fs::is_directory("/dev/shm", none) ? "/dev/shm" : fs::temp_directory_path();
  std::string pattern = (root / "walkman-fuzz-XXXXXX").string();
  require(mkdtemp(pattern.data()) != nullptr, "a folder for the input can be made");
  folder_ = pattern;
  file_ = folder_ / name;
  fs::create_directories(file_.parent_path());
  if (beside.empty()) return;
  // A link to each entry of `beside`, except for the folders on the way to the file, which are real folders.
  fs::path from = beside, to = folder_;
  for (auto part = name.begin();; ++part) {
    for (const auto& entry : fs::directory_iterator(from))
      if (entry.path().filename() != *part)
        fs::create_symlink(fs::absolute(entry.path()), to / entry.path().filename());
    if (std::next(part) == name.end()) return;
    from /= *part;
    to /= *part;
  }
}

InputFile::~InputFile() {
  std::error_code none;
  fs::remove_all(folder_, none);
}

void InputFile::write(std::span<const std::uint8_t> contents) {
  const int file = open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  require(file >= 0, "the input's file can be opened");
  const ssize_t written = ::write(file, contents.data(), contents.size());
  close(file);
  require(written == static_cast<ssize_t>(contents.size()), "the input's file can be written");
}

void InputFile::require_named(const std::string& complaint) const {
  const bool good = complaint.find(folder_.string()) != std::string::npos;
  if (!good) std::fprintf(stderr, "%s\n", complaint.c_str());
  require(good, "a complaint names the file");
}

}  // namespace walkman::fuzz
