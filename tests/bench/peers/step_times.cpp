#include "tests/bench/peers/step_times.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

namespace walkman::peers {
namespace {

double clock_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

}  // namespace

double StepTimes::wall_us() { return clock_us(CLOCK_MONOTONIC); }
double StepTimes::processor_us() { return clock_us(CLOCK_THREAD_CPUTIME_ID); }

double StepTimes::quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto rank = static_cast<std::ptrdiff_t>(std::lround(part * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace walkman::peers
