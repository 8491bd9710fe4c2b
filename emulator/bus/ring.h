#pragma once

#include <cstddef>
#include <vector>

namespace walkman::bus {

/// First-in first-out queue of fixed capacity; all memory is taken at construction.
template <typename T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : slots_(capacity) {}

  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] const T& front() const noexcept { return slots_[head_]; }

  /// False when full; the value is then not taken.
  [[nodiscard]] bool push(const T& value) noexcept {
    if (size_ == slots_.size()) return false;
    std::size_t tail = head_ + size_;
    if (tail >= slots_.size()) tail -= slots_.size();
    slots_[tail] = value;
    ++size_;
    return true;
  }

  void pop() noexcept {
    head_ = head_ + 1 == slots_.size() ? 0 : head_ + 1;
    --size_;
  }

 private:
  std::vector<T> slots_;
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace walkman::bus
