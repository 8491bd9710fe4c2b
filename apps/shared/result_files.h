#pragma once

#include <filesystem>
#include <string_view>

namespace walkman::apps {

/// Name of a file while it is being written: its final name followed by ".partial". A file that an
/// interrupted run leaves under such a name is incomplete.
[[nodiscard]] std::filesystem::path partial(const std::filesystem::path& file);

/// Syncs `partial(file)` to the disk and gives it its final name. Throws EnvironmentError, one sentence; the
/// partial file then still exists.
void publish(const std::filesystem::path& file);

/// The same for a folder's files: moves those in `partial(folder)` into `folder`, one after the other.
void publish_folder(const std::filesystem::path& folder);

/// Writes a file as a whole: under its partial name, synced, renamed. At any time there is either the old
/// file or the new one. Throws EnvironmentError, one sentence.
void write_whole(const std::filesystem::path& file, std::string_view text);

}  // namespace walkman::apps
