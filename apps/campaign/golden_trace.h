#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace walkman::apps {

/// Trace of a run without faults, cycle by cycle: a hash that changes with any bit of the plant or of any
/// frame so far, and the positions in the plant.
class GoldenTrace {
 public:
  /// `positions`: the same number in every cycle.
  void add(std::uint64_t hash, std::span<const float> positions);

  [[nodiscard]] std::size_t cycles() const { return hashes_.size(); }
  [[nodiscard]] std::uint64_t hash(std::size_t cycle) const { return hashes_[cycle]; }
  [[nodiscard]] std::span<const float> positions(std::size_t cycle) const {
    const std::size_t width = positions_.size() / hashes_.size();
    return {positions_.data() + cycle * width, width};
  }

  /// Serialises to this machine's native representation, for programs on this machine.
  [[nodiscard]] std::string bytes() const;
  /// Reads the output of `bytes`. Throws std::runtime_error with the file's name.
  [[nodiscard]] static GoldenTrace load(const std::filesystem::path& file);

 private:
  std::vector<std::uint64_t> hashes_;
  std::vector<float> positions_;
};

}  // namespace walkman::apps
