#include "common/runtime/run_loop.hpp"

#include <dlfcn.h>

#include <cerrno>
#include <cstdio>
#include <ctime>
#include <stdexcept>

namespace farhand {
namespace {

using Hook = void (*)();

Hook find_hook(const char* name) { return reinterpret_cast<Hook>(dlsym(RTLD_DEFAULT, name)); }

void sleep_until(Nanoseconds deadline) noexcept {
  timespec at{};
  at.tv_sec = deadline / kSecond;
  at.tv_nsec = deadline % kSecond;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

}  // namespace

Nanoseconds monotonic_now() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

LoopSchedule::LoopSchedule(const LoopParams& params) : params_(params) {
  if (params_.period_ns <= 0) throw std::invalid_argument("the period of the loop must be positive");
  counting_begin_ = find_hook("farhand_loop_thread_begin");
  counting_end_ = find_hook("farhand_loop_thread_end");
  stats_.realtime = enter_realtime(params_.realtime);
  for (const std::string& warning : stats_.realtime.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  stats_.start_ns = monotonic_now() + params_.period_ns;
  next_ns_ = stats_.start_ns;
}

TickTime LoopSchedule::wait() noexcept {
  sleep_until(next_ns_);
  const Nanoseconds now = monotonic_now();
  const Nanoseconds late = now - next_ns_;
  stats_.wake_latency.add(late);
  const Nanoseconds missed = late > 0 ? late / params_.period_ns : 0;
  stats_.missed += static_cast<std::uint64_t>(missed);

  time_.now_ns = now;
  time_.deadline_ns = next_ns_ + missed * params_.period_ns;
  time_.elapsed_ns = time_.deadline_ns - stats_.start_ns;
  time_.index = stats_.ticks;
  time_.missed = static_cast<std::uint64_t>(missed);
  if (!time_.stopping) {
    const int signal = params_.stop != nullptr ? params_.stop->signal() : 0;
    const bool over = params_.duration_ns > 0 && time_.elapsed_ns >= params_.duration_ns;
    if (signal != 0 || over) {
      time_.stopping = true;
      stopping_since_ns_ = now;
      stats_.signal = signal;
      stats_.cause = signal != 0 ? StopCause::kSignal : StopCause::kDuration;
    }
  }
  const bool suspending = params_.suspend != nullptr && params_.suspend->asked();
  if (suspending && !time_.suspending) suspending_since_ns_ = now;
  time_.suspending = suspending;
  next_ns_ = time_.deadline_ns + params_.period_ns;
  return time_;
}

bool LoopSchedule::done(bool go_on) noexcept {
  const Nanoseconds end = monotonic_now();
  const Nanoseconds duration = end - time_.now_ns;
  stats_.tick_duration.add(duration);
  if (duration > params_.period_ns) ++stats_.overruns;
  ++stats_.ticks;
  // The first tick may still fault pages in and fill caches of libraries; from the second on nothing is excused.
  if (stats_.ticks == 1 && counting_begin_ != nullptr) counting_begin_();
  const bool over = !go_on || (time_.stopping && end - stopping_since_ns_ >= params_.stop_grace_ns);
  if (time_.suspending && !over && end - suspending_since_ns_ >= params_.rest_ns) {
    params_.suspend->suspend();
  }
  return over;
}

RunStats LoopSchedule::finish() noexcept {
  if (counting_end_ != nullptr) counting_end_();
  stats_.end_ns = monotonic_now();
  return std::move(stats_);
}

}  // namespace farhand
