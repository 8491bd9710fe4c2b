#include "emulator/gateways/owned_path.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

namespace walkman::gateways {

OwnedPath::OwnedPath(std::filesystem::path path)
    : path_(std::move(path)), entry_(::open(path_.c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC)) {
  if (!entry_.valid()) throw std::runtime_error(path_.string() + ": " + std::strerror(errno));
}

OwnedPath& OwnedPath::operator=(OwnedPath&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(entry_, other.entry_);
  return *this;
}

void OwnedPath::remove() noexcept {
  if (!entry_.valid()) return;
  struct stat made {};
  struct stat there {};
  const bool same = fstat(entry_.get(), &made) == 0 && lstat(path_.c_str(), &there) == 0 &&
                    made.st_dev == there.st_dev && made.st_ino == there.st_ino;
  if (same) static_cast<void>(::unlink(path_.c_str()));
  entry_ = Descriptor();
}

FolderLock::FolderLock(const std::filesystem::path& path)
    : folder_(::open(path.has_parent_path() ? path.parent_path().c_str() : ".",
                     O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_.valid()) static_cast<void>(flock(folder_.get(), LOCK_EX));
}

}  // namespace walkman::gateways
