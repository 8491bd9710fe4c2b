#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>

namespace walkman::fuzz {

/// A private folder of this process with one file that takes each input as its contents; other files that it
/// may name are there as links to the source tree.
class InputFile {
 public:
  /// `name`: path below the folder; `beside`: a folder of the source tree whose entries are linked there as
  /// if the file were at `name` in it; empty: none.
  explicit InputFile(const std::filesystem::path& name, const std::filesystem::path& beside = {});
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  void write(std::span<const std::uint8_t> contents);
  [[nodiscard]] const std::filesystem::path& path() const { return file_; }

  /// Lets `read` throw std::runtime_error with a sentence that names the file, or a file that it names, and
  /// nothing else.
  template <typename Read>
  void read_or_refuse(const Read& read) const {
    try {
      read();
    } catch (const std::runtime_error& complaint) {
      require_named(complaint.what());
    }
  }

 private:
  void require_named(const std::string& complaint) const;

  std::filesystem::path folder_, file_;
};

}  // namespace walkman::fuzz
