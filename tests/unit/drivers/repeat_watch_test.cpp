#include "drivers/cia404/repeat_watch.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace walkman::cia404 {
namespace {

/// Three channels with white noise, as integers.
class Noisy {
 public:
  explicit Noisy(double sigma) : normal_(0, sigma) {}
  RepeatWatch::Reading next() {
    RepeatWatch::Reading out;
    for (auto& channel : out) channel = static_cast<std::int16_t>(std::lround(100.3 + normal_(generator_)));
    return out;
  }

 private:
  std::mt19937 generator_{7};
  std::normal_distribution<double> normal_;
};

class HealthyNoise : public testing::TestWithParam<double> {};  // standard deviation in steps

TEST_P(HealthyNoise, IsNeverCalledFrozen) {
  Noisy noisy(GetParam());
  RepeatWatch watch;
  for (int i = 0; i < 2'000'000; ++i) {
    watch.take(noisy.next());
    ASSERT_EQ(watch.frozen(), 0) << "sample " << i;
  }
}

// Below a third of a step, three channels repeat more often than not, which proves nothing.
INSTANTIATE_TEST_SUITE_P(Sigmas, HealthyNoise, testing::Values(0.0, 0.05, 0.2, 0.3, 0.4, 0.5, 1.0, 3.0));

TEST(FrozenNoise, IsSeenAfterFortySamples) {
  for (const double sigma : {0.5, 1.0, 3.0}) {
    Noisy noisy(sigma);
    RepeatWatch watch;
    for (int i = 0; i < 400; ++i) watch.take(noisy.next());
    const RepeatWatch::Reading stuck{1000, 1001, 1002};  // not a value of the noise
    int samples = 0;
    for (; watch.frozen() == 0 && samples < 100; ++samples) watch.take(stuck);
    EXPECT_EQ(samples, RepeatWatch::kMost + 1) << "the first, and forty repeats";
    watch.restart();
    EXPECT_EQ(watch.frozen(), 0);
    for (samples = 0; watch.frozen() == 0 && samples < 100; ++samples) watch.take(stuck);
    EXPECT_EQ(samples, RepeatWatch::kMost) << "it is known to have had noise";
  }
}

}  // namespace
}  // namespace walkman::cia404
