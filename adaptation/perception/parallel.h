#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

namespace walkman::perception {

/// Calls `work(begin, end)` on `threads` contiguous parts of [0, count), one thread each; returns when all
/// are done. `work` must not throw. Results do not depend on `threads` when `work` writes only to its own
/// indices.
template <typename Work>
void parallel_ranges(std::size_t count, int threads, const Work& work) {
  const auto parts = static_cast<std::size_t>(std::max(1, threads));
  if (parts == 1 || count < 2 * parts) {
    work(std::size_t{0}, count);
    return;
  }
  std::vector<std::thread> others;
  others.reserve(parts - 1);
  for (std::size_t part = 1; part < parts; ++part)
    others.emplace_back(
        [&work, count, part, parts] { work(count * part / parts, count * (part + 1) / parts); });
  work(std::size_t{0}, count / parts);
  for (auto& thread : others) thread.join();
}

}  // namespace walkman::perception
