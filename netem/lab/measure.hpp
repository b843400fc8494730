// Measures times as medians of batches, on a machine that also does other work.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <vector>

#include "netem/lab/explain.hpp"

namespace farhand {

using Clock = std::chrono::steady_clock;
// Forces the compiler to compute the value.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "r,m"(&value) : "memory");
}

inline double ns_since(Clock::time_point start) {
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

// Processor time of this thread, without that of others. A call is too slow for measuring a single tick.
inline double thread_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

inline Cost summary(std::vector<double> ns) {
  std::sort(ns.begin(), ns.end());
  return {ns[ns.size() / 2], ns[ns.size() / 4], ns[ns.size() - 1 - ns.size() / 4]};
}

inline constexpr int kBatches = 9;

// batch() does `ticks` ticks. The first one warms up and is not counted.
template <class Batch>
Cost measure(std::size_t ticks, Batch&& batch) {
  std::vector<double> ns;
  for (int k = 0; k <= kBatches; ++k) {
    const double start = thread_ns();
    batch();
    if (k > 0) ns.push_back((thread_ns() - start) / static_cast<double>(ticks));
  }
  return summary(std::move(ns));
}

// Time that one part adds to a whole: both are measured alternately, so that a machine that slows down slows both.
template <class With, class Without>
Cost difference(std::size_t ticks, With&& with, Without&& without) {
  std::vector<double> ns;
  for (int k = 0; k <= kBatches; ++k) {
    const double start = thread_ns();
    with();
    const double middle = thread_ns();
    without();
    if (k > 0) ns.push_back((2 * middle - start - thread_ns()) / static_cast<double>(ticks));
  }
  return summary(std::move(ns));
}

}  // namespace farhand
