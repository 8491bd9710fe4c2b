#pragma once

#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

namespace walkman::gateways {

/// Text on its way to a peer: first-in first-out, of fixed capacity, added in whole messages and removed in
/// pieces of any size. All memory is allocated at construction.
class TextQueue {
 public:
  explicit TextQueue(std::size_t capacity) : buffer_(capacity) {}

  /// Returns false if the whole message does not fit; then none of it is added.
  [[nodiscard]] bool push(std::string_view message) noexcept {
    if (message.size() > room()) return false;
    if (message.empty()) return true;
    if (message.size() > buffer_.size() - tail_) {
      std::memmove(buffer_.data(), buffer_.data() + head_, tail_ - head_);
      tail_ -= head_;
      head_ = 0;
    }
    std::memcpy(buffer_.data() + tail_, message.data(), message.size());
    tail_ += message.size();
    return true;
  }

  [[nodiscard]] bool empty() const noexcept { return head_ == tail_; }
  [[nodiscard]] std::size_t room() const noexcept { return buffer_.size() - (tail_ - head_); }

  /// All text waiting; valid until the next call of another member.
  [[nodiscard]] std::string_view text() const noexcept { return {buffer_.data() + head_, tail_ - head_}; }

  /// Removes the first `count` characters; there must be that many.
  void pop(std::size_t count) noexcept {
    head_ += count;
    if (head_ == tail_) clear();
  }

  void clear() noexcept { head_ = tail_ = 0; }

 private:
  std::vector<char> buffer_;
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
};

}  // namespace walkman::gateways
