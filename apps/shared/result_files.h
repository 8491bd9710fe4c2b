#pragma once

#include <filesystem>
#include <string_view>

namespace walkman::apps {

/// Name that a file has while it is being written: the file's own with ".partial" behind it. What an
/// interrupted run leaves under such a name is not complete.
[[nodiscard]] std::filesystem::path partial(const std::filesystem::path& file);

/// Brings `partial(file)` to the disk and gives it its name. Throws EnvironmentError, one sentence; the
/// partial file is then still there.
void publish(const std::filesystem::path& file);

/// The same for a folder's files: brings those in `partial(folder)` into `folder`, one after the other.
void publish_folder(const std::filesystem::path& folder);

/// Writes a file as a whole: under its partial name, synced, renamed. At any time there is either the file of
/// before or the new one. Throws EnvironmentError, one sentence.
void write_whole(const std::filesystem::path& file, std::string_view text);

}  // namespace walkman::apps
