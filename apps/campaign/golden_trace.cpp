#include "apps/campaign/golden_trace.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace walkman::apps {

void GoldenTrace::add(std::uint64_t hash, std::span<const float> positions) {
  hashes_.push_back(hash);
  positions_.insert(positions_.end(), positions.begin(), positions.end());
}

std::string GoldenTrace::bytes() const {
  const std::uint64_t cycles = hashes_.size();
  std::string out(sizeof cycles + cycles * sizeof(std::uint64_t) + positions_.size() * sizeof(float), '\0');
  char* to = out.data();
  std::memcpy(to, &cycles, sizeof cycles);
  std::memcpy(to += sizeof cycles, hashes_.data(), cycles * sizeof(std::uint64_t));
  std::memcpy(to + cycles * sizeof(std::uint64_t), positions_.data(), positions_.size() * sizeof(float));
  return out;
}

GoldenTrace GoldenTrace::load(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  GoldenTrace out;
  std::uint64_t cycles = 0;
  if (bytes.size() >= sizeof cycles) std::memcpy(&cycles, bytes.data(), sizeof cycles);
  const std::size_t rest = bytes.size() - std::min(bytes.size(), sizeof cycles);
  if (cycles == 0 || cycles > rest / sizeof(std::uint64_t) ||
      (rest - cycles * sizeof(std::uint64_t)) % (cycles * sizeof(float)) != 0)
    throw std::runtime_error(file.string() +
                             ": not a golden run's trace, expected the file as the campaign wrote it");
  out.hashes_.resize(cycles);
  out.positions_.resize((rest - cycles * sizeof(std::uint64_t)) / sizeof(float));
  const char* from = bytes.data() + sizeof cycles;
  std::memcpy(out.hashes_.data(), from, cycles * sizeof(std::uint64_t));
  from += cycles * sizeof(std::uint64_t);
  std::memcpy(out.positions_.data(), from, out.positions_.size() * sizeof(float));
  return out;
}

}  // namespace walkman::apps
