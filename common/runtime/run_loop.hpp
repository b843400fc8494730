// The loop of a station: one thread that wakes at absolute deadlines and calls `tick`, which does control, socket and
// serial line. Only this file reads the clock. A missed deadline is skipped and never made up for. The number of
// skipped ones is an argument of the tick, because a law that differentiates across a gap must know it.
#pragma once

#include <concepts>
#include <cstdint>
#include <utility>

#include "common/runtime/duration_histogram.hpp"
#include "common/runtime/realtime.hpp"
#include "common/runtime/stop_signals.hpp"
#include "common/runtime/suspend_signal.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

Nanoseconds monotonic_now() noexcept;

struct LoopParams {
  Nanoseconds period_ns = kMillisecond;
  Nanoseconds duration_ns = 0;  // 0: until stopped
  // Time for which `tick` may go on after the request to stop, so that it can bring torque to zero before it returns
  // false.
  Nanoseconds stop_grace_ns = kSecond / 2;
  RealtimeParams realtime{};
  const StopSignals* stop = nullptr;
  SuspendSignal* suspend = nullptr;
  Nanoseconds rest_ns = 300 * kMillisecond;  // time to come to rest before the program is suspended
};

struct TickTime {
  Nanoseconds now_ns = 0;       // when this tick woke up
  Nanoseconds deadline_ns = 0;  // when it should have woken up
  Nanoseconds elapsed_ns = 0;   // deadline since the start of the loop
  std::uint64_t index = 0;      // ticks run before this one
  std::uint64_t missed = 0;     // deadlines skipped since the last tick
  bool stopping = false;        // a signal came or the duration is over: come to rest, then return false
  bool suspending = false;      // the program will be suspended: come to rest
};

enum class StopCause { kTick, kDuration, kSignal };

struct RunStats {
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;  // ticks that took longer than the period, our own fault
  std::uint64_t missed = 0;    // deadlines skipped, by an overrun or because the machine woke this thread late
  DurationHistogram tick_duration;
  DurationHistogram wake_latency;
  Nanoseconds start_ns = 0, end_ns = 0;
  StopCause cause = StopCause::kTick;
  int signal = 0;  // the one that stopped the loop, or 0
  RealtimeReport realtime;
};

// True to go on, false to end the loop.
template <class Tick>
concept LoopTick = requires(Tick& tick, const TickTime& time) {
  { tick(time) }
  noexcept->std::same_as<bool>;
};

// The schedule of the loop without the tick; `run` below is its only user.
class LoopSchedule {
 public:
  // Enters real time (refusals are printed on stderr), then sets the first deadline.
  explicit LoopSchedule(const LoopParams& params);

  TickTime wait() noexcept;        // sleeps until the next deadline that has not passed
  bool done(bool go_on) noexcept;  // books the tick; true when the loop is over
  RunStats finish() noexcept;

 private:
  LoopParams params_;
  RunStats stats_;
  TickTime time_;
  Nanoseconds next_ns_ = 0;
  Nanoseconds stopping_since_ns_ = 0, suspending_since_ns_ = 0;
  // Set by a library that counts heap calls and locks per thread, if it is loaded (tests), else nullptr.
  void (*counting_begin_)() = nullptr;
  void (*counting_end_)() = nullptr;
};

template <LoopTick Tick>
RunStats run(const LoopParams& params, Tick&& tick) {
  LoopSchedule schedule(params);
  bool over = false;
  while (!over) {
    const TickTime time = schedule.wait();
    over = schedule.done(tick(time));
  }
  return schedule.finish();
}

}  // namespace farhand
