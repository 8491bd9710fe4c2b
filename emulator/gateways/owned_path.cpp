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

void make_private_folder(const std::filesystem::path& folder) {
  struct stat there {};
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
    throw std::runtime_error(folder.string() + ": the folder cannot be made (" + std::strerror(errno) + ")");
  }
  if (lstat(folder.c_str(), &there) != 0)
    throw std::runtime_error(folder.string() + ": " + std::strerror(errno));
  const bool ours = S_ISDIR(there.st_mode) && there.st_uid == geteuid();
  if (ours && (there.st_mode & (S_IRWXG | S_IRWXO)) == 0) return;
  throw std::runtime_error(folder.string() +
                           (ours ? ": others may enter this folder, expected mode 0700"
                                 : ": not a folder of this user's, expected one with mode 0700"));
}

}  // namespace walkman::gateways
