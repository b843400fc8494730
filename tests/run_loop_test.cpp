// The heartbeat and what hangs on it: schedule, stop signals, real-time wishes, exchange between threads, live line.
#include "common/runtime/run_loop.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "common/exchange/latest.hpp"
#include "common/runtime/live_status.hpp"
#include "tests/support/pipe.hpp"

namespace farhand {
namespace {

void spin_for(Nanoseconds duration) {
  const Nanoseconds end = monotonic_now() + duration;
  while (monotonic_now() < end) {
  }
}

TEST(DurationHistogram, QuantileIsAtMost1Of128AboveTheTrueOne) {
  std::mt19937_64 random(7);
  std::vector<Nanoseconds> values;
  DurationHistogram histogram;
  for (int i = 0; i < 20'000; ++i) {
    const auto value = static_cast<Nanoseconds>(random() >> (25 + random() % 39));  // every magnitude up to 2^39
    values.push_back(value);
    histogram.add(value);
  }
  std::sort(values.begin(), values.end());
  for (const double q : {0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const Nanoseconds exact = values[static_cast<std::size_t>(std::ceil(q * 20'000)) - 1];
    EXPECT_GE(histogram.quantile(q), exact) << q;
    EXPECT_LE(histogram.quantile(q), exact + exact / 128) << q;
  }
  EXPECT_EQ(histogram.max(), values.back());
}

TEST(DurationHistogram, TakesEmptyNegativeAndEndlessDurations) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0);
  histogram.add(-5);
  EXPECT_EQ(histogram.quantile(1), 0);
  histogram.add(std::numeric_limits<Nanoseconds>::max());
  EXPECT_EQ(histogram.max(), std::numeric_limits<Nanoseconds>::max());
  EXPECT_EQ(histogram.count(), 2u);
}

TEST(RunLoop, EveryDeadlineIsEitherRunOrCountedAsMissed) {
  std::uint64_t counted = 0;
  Nanoseconds previous = -1;
  std::uint64_t missed = 0;
  const RunStats stats = run({.duration_ns = 100 * kMillisecond}, [&](const TickTime& time) noexcept {
    EXPECT_EQ(time.index, counted++);
    EXPECT_GE(time.now_ns, time.deadline_ns);
    EXPECT_EQ(time.elapsed_ns % kMillisecond, 0);  // the phase never drifts
    if (previous >= 0) {
      EXPECT_EQ(time.elapsed_ns - previous, kMillisecond * static_cast<Nanoseconds>(1 + time.missed));
    }
    previous = time.elapsed_ns;
    missed += time.missed;
    return !time.stopping;
  });
  EXPECT_EQ(stats.cause, StopCause::kDuration);
  EXPECT_EQ(stats.ticks, counted);
  EXPECT_EQ(stats.missed, missed);
  EXPECT_EQ(stats.ticks + stats.missed, static_cast<std::uint64_t>(previous / kMillisecond) + 1);
  EXPECT_EQ(stats.tick_duration.count(), counted);
  EXPECT_EQ(stats.wake_latency.count(), counted);
}

TEST(RunLoop, ALongTickIsAnOverrunAndItsDeadlinesAreSkippedNotReplayed) {
  std::uint64_t missed_after = 0;
  const RunStats stats = run({}, [&](const TickTime& time) noexcept {
    if (time.index == 3) spin_for(10 * kMillisecond + kMillisecond / 2);
    if (time.index == 4) missed_after = time.missed;
    return time.index < 6;
  });
  EXPECT_EQ(stats.ticks, 7u);
  EXPECT_GE(stats.overruns, 1u);
  EXPECT_GE(missed_after, 9u);
  EXPECT_EQ(stats.cause, StopCause::kTick);
  EXPECT_GE(stats.tick_duration.max(), 10 * kMillisecond);
}

TEST(RunLoop, GivesTheTickTimeToComeToRestButNotForever) {
  std::uint64_t while_stopping = 0;
  const RunStats stats =
      run({.duration_ns = 5 * kMillisecond, .stop_grace_ns = 20 * kMillisecond}, [&](const TickTime& time) noexcept {
        while_stopping += time.stopping ? 1 : 0;
        return true;
      });
  EXPECT_GE(while_stopping, 1u);
  EXPECT_GE(stats.end_ns - stats.start_ns, 25 * kMillisecond);
}

TEST(RunLoop, RefusesAPeriodThatIsNotPositive) {
  EXPECT_THROW(run({.period_ns = 0}, [](const TickTime&) noexcept { return false; }), std::invalid_argument);
}

class StopSignal : public testing::TestWithParam<int> {};

TEST_P(StopSignal, StopsTheLoopSafelyHoweverOftenItComes) {
  const StopSignals signals;
  EXPECT_EQ(signals.signal(), 0);
  bool seen = false;
  const RunStats stats = run({.stop = &signals}, [&](const TickTime& time) noexcept {
    if (time.index == 2) {
      raise(GetParam());
      raise(GetParam());
      raise(SIGTERM);
    }
    seen = time.stopping;
    return !(time.stopping || time.index > 5000);
  });
  EXPECT_TRUE(seen);
  EXPECT_EQ(stats.cause, StopCause::kSignal);
  EXPECT_EQ(stats.signal, GetParam());
}
INSTANTIATE_TEST_SUITE_P(Each, StopSignal,
                         testing::Values(SIGINT, SIGQUIT, SIGTERM, SIGHUP, SIGUSR1, SIGALRM, SIGRTMIN, SIGRTMIN + 5,
                                         SIGRTMAX));

TEST(StopSignals, RestoresTheHandlersThatWereThereBefore) {
  struct sigaction before {};
  sigaction(SIGTERM, nullptr, &before);
  { const StopSignals signals; }
  struct sigaction after {};
  sigaction(SIGTERM, nullptr, &after);
  EXPECT_EQ(after.sa_handler, before.sa_handler);
}

TEST(Realtime, ReportsWhatTheKernelSaysAndASentenceForWhatItRefused) {
  RealtimeReport report;
  int policy_of_child = -1;
  std::thread([&] {
    report = enter_realtime({.fifo_priority = 5, .lock_memory = true});
    EXPECT_EQ(report.fifo, (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_FIFO);
    std::thread([&] { policy_of_child = sched_getscheduler(0); }).join();
  }).join();
  EXPECT_EQ(policy_of_child, SCHED_OTHER) << "a thread started by the loop must not inherit its priority";
  EXPECT_EQ(report.warnings.size(), (report.fifo ? 0u : 1u) + (report.locked ? 0u : 1u));
  for (const std::string& warning : report.warnings) EXPECT_NE(warning.find("limits.d"), std::string::npos) << warning;
  std::printf("fifo %d, locked %d\n", report.fifo, report.locked);
}

TEST(Realtime, APriorityThatDoesNotExistIsRefusedWithTheReason) {
  std::thread([] {
    const RealtimeReport report = enter_realtime({.fifo_priority = 1000});
    EXPECT_FALSE(report.fifo);
    ASSERT_EQ(report.warnings.size(), 1u);
    EXPECT_NE(report.warnings[0].find("Invalid argument"), std::string::npos) << report.warnings[0];
  }).join();
}

TEST(Latest, ReaderSeesWholeValuesInOrderAndTheLastOne) {
  struct Pair {
    std::uint64_t a = 0, b = 0, c = 0, d = 0;
  };
  constexpr std::uint64_t kLast = 200'000;
  Latest<Pair> latest;
  Pair value;
  EXPECT_FALSE(latest.read(value));
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) latest.write({i, 2 * i, 3 * i, 4 * i});
  });
  std::uint64_t newest = 0;
  while (newest < kLast) {
    if (!latest.read(value)) continue;
    ASSERT_GT(value.a, newest);
    ASSERT_TRUE(value.b == 2 * value.a && value.c == 3 * value.a && value.d == 4 * value.a);
    newest = value.a;
  }
  writer.join();
  EXPECT_FALSE(latest.read(value));
}

TEST(LiveStatus, ShowsEveryNumberAndDashesForTheUnknown) {
  EXPECT_EQ(
      format_live_status({12.34, StationState::kEngaged, 0.5, -0.25, 1.5, -2, 0.2031, 0.011}),
      "   12.3 s  engaged    x_m  +0.500  x_s  -0.250 rad  f_m  +1.500  f_s  -2.000 N m  RTT 203.1 ms  loss 1.1 %");
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const std::string line = format_live_status({0, StationState::kReady, 0, 0, 0, 0, unknown, unknown});
  EXPECT_NE(line.find("RTT - ms  loss - %"), std::string::npos) << line;
}

TEST(LiveStatus, TellsOfAGapOfTheNetwork) {
  EXPECT_NE(format_live_status({.waits = true, .resumed = 2}).find("  may resume  resumed 2"), std::string::npos);
  EXPECT_EQ(format_live_status({}).find("resume"), std::string::npos);
}

TEST(LiveStatus, TellsOfALineWhatIsKnownOfIt) {
  EXPECT_EQ(format_live_status({}).find("line"), std::string::npos) << "there is none";
  EXPECT_NE(format_live_status({.line_s = 0.004}).find("  line 4.0 ms"), std::string::npos);
  EXPECT_NE(format_live_status({.line_s = 0.016, .line_lags = true}).find("  line 16.0 ms LAGS"), std::string::npos);
  const std::string slow = format_live_status({.line_s = 0.012, .line_slow = true});
  EXPECT_NE(slow.find("latency timer"), std::string::npos) << slow;
  const std::string late = format_live_status({.line_s = 0.004, .line_blind = true, .line_slow = true});
  EXPECT_NE(late.find("  line not known: this PC is late  this PC looks too late"), std::string::npos) << late;
  EXPECT_EQ(late.find("latency timer"), std::string::npos) << late;
}

TEST(LiveStatus, PrintsTheNewestAtTheEndAsAPlainLineAndNothingWhenQuiet) {
  for (const bool quiet : {false, true}) {
    Pipe pipe;
    {
      LiveStatusPrinter printer(quiet, pipe.in());
      for (int i = 0; i < 100; ++i) printer.show({.t_s = i / 10.0});
    }
    pipe.finish();
    char text[4096] = {};
    const ssize_t size = read(pipe.out(), text, sizeof text - 1);
    const std::string printed(text, static_cast<std::size_t>(size));
    EXPECT_EQ(printed.find('\r'), std::string::npos);
    EXPECT_EQ(printed.find("9.9 s") == std::string::npos, quiet) << printed;
    EXPECT_EQ(printed.empty(), quiet);
  }
}

TEST(LiveStatus, AReaderThatNeverReadsDoesNotHoldUpTheEnd) {
  Pipe pipe;
  fcntl(pipe.in(), F_SETFL, O_NONBLOCK);
  const std::string block(4096, '.');
  while (write(pipe.in(), block.data(), block.size()) > 0) {
  }
  fcntl(pipe.in(), F_SETFL, 0);
  LiveStatusPrinter printer(false, pipe.in());
  printer.show({});
}

}  // namespace
}  // namespace farhand
