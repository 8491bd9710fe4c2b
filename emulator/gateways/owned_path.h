#pragma once

#include <filesystem>

#include "emulator/gateways/descriptor.h"

namespace walkman::gateways {

/// A file, socket or symbolic link that this program has made: removed at the end, unless something else has
/// been put in its place. What was made is told from what is there by device and inode, and the inode is held
/// so that its number cannot come to mean another file.
class OwnedPath {
 public:
  OwnedPath() = default;

  /// Takes charge of what is at `path` now. Throws std::runtime_error with the path when nothing is.
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

/// While it lives, no other emulator makes or replaces anything in the folder of `path`: two that start at
/// once do not take each other's entry for one that was left behind. Without effect when the folder cannot be
/// opened; what follows then fails with its own reason.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& path);

 private:
  Descriptor folder_;
};

}  // namespace walkman::gateways
