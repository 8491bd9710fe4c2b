#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace walkman::apps {

/// What a run without faults was like, cycle by cycle: a number that changes with any bit of the plant or of
/// any frame so far, and where things were.
class GoldenTrace {
 public:
  /// `positions` as many in every cycle.
  void add(std::uint64_t hash, std::span<const float> positions);

  [[nodiscard]] std::size_t cycles() const { return hashes_.size(); }
  [[nodiscard]] std::uint64_t hash(std::size_t cycle) const { return hashes_[cycle]; }
  [[nodiscard]] std::span<const float> positions(std::size_t cycle) const {
    const std::size_t width = positions_.size() / hashes_.size();
    return {positions_.data() + cycle * width, width};
  }

  /// As bytes of this machine's own, for this machine's programs.
  [[nodiscard]] std::string bytes() const;
  /// Reads what `bytes` has made. Throws std::runtime_error with the file's name.
  [[nodiscard]] static GoldenTrace load(const std::filesystem::path& file);

 private:
  std::vector<std::uint64_t> hashes_;
  std::vector<float> positions_;
};

}  // namespace walkman::apps
