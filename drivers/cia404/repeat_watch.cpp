#include "drivers/cia404/repeat_watch.h"

#include <algorithm>

namespace walkman::cia404 {

void RepeatWatch::take(const Reading& reading) noexcept {
  const bool same = taken_ > 0 && reading == last_;
  last_ = reading;
  taken_ = std::min(taken_ + 1, kMost);
  if (!same) {
    repeats_ = 0;
    lively_ = taken_ == kMost && repeating_ < 0.5;
  } else {
    ++repeats_;
  }
  repeating_ += ((same ? 1 : 0) - repeating_) / kMost;
  if (lively_ && repeats_ >= kMost) frozen_ = repeats_;
}

}  // namespace walkman::cia404
