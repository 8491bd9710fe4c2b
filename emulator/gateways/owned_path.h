#pragma once

#include <filesystem>

#include "emulator/gateways/descriptor.h"

namespace walkman::gateways {

/// A file, socket or symbolic link that this program has made: removed at the end, unless something else has
/// been put in its place. What was made is identified by device and inode, and the inode is held so that its
/// number cannot be reused for another file.
class OwnedPath {
 public:
  OwnedPath() = default;

  /// Takes ownership of what is at `path` now. Throws std::runtime_error with the path if nothing is.
  explicit OwnedPath(std::filesystem::path path);
  ~OwnedPath() { remove(); }
  OwnedPath(OwnedPath&& other) noexcept = default;
  OwnedPath& operator=(OwnedPath&& other) noexcept;
  OwnedPath(const OwnedPath&) = delete;
  OwnedPath& operator=(const OwnedPath&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  /// Removes it now, if it still is what was made.
  void remove() noexcept;

 private:
  std::filesystem::path path_;
  Descriptor entry_;  // of the directory entry itself, not of what a link points to
};

/// While it exists, no other emulator makes or replaces anything in the folder of `path`: two that start at
/// once do not mistake each other's entry for one left behind. No effect if the folder cannot be opened; what
/// follows then fails with its own reason.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& path);

 private:
  Descriptor folder_;
};

}  // namespace walkman::gateways
