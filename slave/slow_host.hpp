// Reports, while it happens, that the host is too slow for an emulator. A thread of its own prints, so that the loop
// neither prints nor waits.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace farhand {

// Decides what to report each time it is called. A stall is known only when it is over, and may be longer than the time
// since the last call.
class LeftOut {
 public:
  // all_ms: time left out so far; now_s: time since the start. Returns a sentence, or an empty one.
  std::string look(std::uint64_t all_ms, double now_s) {
    const std::uint64_t ms = all_ms - std::exchange(all_ms_, all_ms);
    const double since_s = now_s - std::exchange(looked_s_, now_s);
    if (static_cast<double>(ms) < kTooMuch * 1e3 * since_s) return {};
    char text[160];
    std::snprintf(text, sizeof text,
                  "this host is too slow: stalls that ended in the last %.1f s left %llu ms out of the orthosis' time",
                  since_s, static_cast<unsigned long long>(ms));
    return text;
  }

 private:
  static constexpr double kTooMuch = 0.02;
  std::uint64_t all_ms_ = 0;
  double looked_s_ = 0.0;
};

class SlowHost {
 public:
  SlowHost() : teller_([this] { tell(); }) {}
  ~SlowHost() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    ended_.notify_one();
    teller_.join();
  }
  SlowHost(const SlowHost&) = delete;
  SlowHost& operator=(const SlowHost&) = delete;

  // Called by the loop: `ms` of the device's time were left out.
  void missed(std::uint64_t ms) noexcept {
    stalls_.fetch_add(1, std::memory_order_relaxed);
    ms_.fetch_add(ms, std::memory_order_relaxed);
  }
  std::uint64_t stalls() const noexcept { return stalls_.load(std::memory_order_relaxed); }
  std::uint64_t ms() const noexcept { return ms_.load(std::memory_order_relaxed); }

 private:
  static constexpr int kEveryMs = 2000;

  void tell() {
    const auto begun = std::chrono::steady_clock::now();
    LeftOut left_out;
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, std::chrono::milliseconds(kEveryMs), [this] { return over_; })) {
      const std::chrono::duration<double> now = std::chrono::steady_clock::now() - begun;
      const std::string sentence = left_out.look(ms(), now.count());
      if (!sentence.empty()) std::fprintf(stderr, "farhand-mcu: %s\n", sentence.c_str());
    }
  }

  std::atomic<std::uint64_t> stalls_{0}, ms_{0};
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  std::thread teller_;
};

}  // namespace farhand
