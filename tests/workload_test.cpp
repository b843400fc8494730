// Workload in pieces: each once, whatever the number of threads; the first mistake; and a signal that ends it.
#include "netem/lab/workload.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace farhand {
namespace {

TEST(Workload, DoesEachPieceOnceForAnyNumberOfThreads) {
  for (const int threads : {0, 1, 2, 7}) {
    for (const std::size_t count : {0u, 1u, 5u, 300u}) {
      std::vector<std::atomic<int>> calls(count);
      EXPECT_TRUE(Workload(threads).each(count, [&](std::size_t k) { ++calls[k]; }));
      for (const std::atomic<int>& n : calls) EXPECT_EQ(n, 1);
    }
  }
}

TEST(Workload, ThrowsWhatTheFirstPieceThrows) {
  for (const int threads : {1, 2, 4}) {
    std::atomic<int> ran{0};
    try {
      Workload(threads).each(1000, [&](std::size_t k) {
        ++ran;
        if (k >= 3) throw std::runtime_error(std::to_string(k));
      });
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
    EXPECT_LE(ran, 3 + threads);
  }
}

TEST(Workload, EndsAfterThePiecesThatRunOnceASignalComes) {
  for (const int threads : {1, 2, 4}) {
    const Workload work(threads, "pieces");
    std::vector<std::atomic<int>> calls(1000);
    EXPECT_FALSE(work.each(calls.size(), [&](std::size_t k) {
      ++calls[k];
      if (k == 10) std::raise(SIGINT);
      while (k > 10 && !work.stopped()) std::this_thread::yield();
    }));
    std::size_t done = 0;
    while (done < calls.size() && calls[done] == 1) ++done;
    EXPECT_GE(done, 11u);
    EXPECT_LE(done, 11u + static_cast<std::size_t>(threads) - 1);
    for (std::size_t k = done; k < calls.size(); ++k) EXPECT_EQ(calls[k], 0) << k;
    try {
      work.require_all(false);
      FAIL();
    } catch (const Stopped& stopped) {
      EXPECT_EQ(stopped.done, done);
      EXPECT_EQ(stopped.total, 1000u);
      EXPECT_EQ(stopped.what, "pieces");
    }
  }
}

}  // namespace
}  // namespace farhand
