#include "emulator/nodes/cia301/outbox.h"

#include <algorithm>

namespace walkman::nodes {

void Outbox::push(const can::Frame& frame) noexcept {
  if (size_ == kCapacity) {
    ++overflows_;
    return;
  }
  std::size_t place = size_;
  while (place > 0 && frames_[place - 1].id <= frame.id) --place;
  std::copy_backward(frames_.begin() + place, frames_.begin() + size_, frames_.begin() + size_ + 1);
  frames_[place] = frame;
  ++size_;
}

void Outbox::replace(const can::Frame& frame) noexcept {
  for (std::size_t i = 0; i < size_; ++i) {
    if (frames_[i].id == frame.id) {
      frames_[i] = frame;
      return;
    }
  }
  push(frame);
}

void Outbox::drop(std::uint32_t id) noexcept {
  const auto end = frames_.begin() + size_;
  const auto kept = std::remove_if(frames_.begin(), end, [&](const can::Frame& f) { return f.id == id; });
  size_ = static_cast<std::size_t>(kept - frames_.begin());
}

bool Outbox::holds(std::uint32_t id) const noexcept {
  const auto end = frames_.begin() + size_;
  return std::any_of(frames_.begin(), end, [&](const can::Frame& f) { return f.id == id; });
}

}  // namespace walkman::nodes
