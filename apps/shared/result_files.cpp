#include "apps/shared/result_files.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"

namespace walkman::apps {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
  throw EnvironmentError(
      fmt::format("{}: cannot be written completely ({}), expected space on a writable device", file.string(),
                  error == 0 ? "no reason given" : std::strerror(error)));
}

/// Syncs a file or a folder to the disk; file systems that do not support syncing folders are tolerated.
void sync(const std::filesystem::path& path, const std::filesystem::path& named, int flags) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | flags);
  if (descriptor < 0) fail(named, errno);
  const int error = fsync(descriptor) == 0 ? 0 : errno;
  close(descriptor);
  if (error != 0 && error != EINVAL) fail(named, error);
}

void move_synced(const std::filesystem::path& from, const std::filesystem::path& to) {
  sync(from, to, 0);
  if (std::rename(from.c_str(), to.c_str()) != 0) fail(to, errno);
}

}  // namespace

std::filesystem::path partial(const std::filesystem::path& file) {
  std::filesystem::path name = file;
  return name += ".partial";
}

void publish(const std::filesystem::path& file) {
  move_synced(partial(file), file);
  const std::filesystem::path folder = file.parent_path();
  sync(folder.empty() ? "." : folder, file, O_DIRECTORY);
}

void publish_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) fail(folder, error.value());
  for (const auto& entry : std::filesystem::directory_iterator(partial(folder), error)) {
    move_synced(entry.path(), folder / entry.path().filename());
  }
  if (error) fail(folder, error.value());
  sync(folder, folder, O_DIRECTORY);
  std::filesystem::remove(partial(folder), error);
}

void write_whole(const std::filesystem::path& file, std::string_view text) {
  errno = 0;
  std::ofstream stream(partial(file), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) fail(file, errno);
  publish(file);
}

}  // namespace walkman::apps
