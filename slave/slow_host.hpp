// Says while it happens that the host is too slow for an emulator: from a thread of its own, so that its loop neither
// prints nor waits.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <thread>

namespace farhand {

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

  // From the loop: so many ms of the device's time were left out.
  void missed(std::uint64_t ms) noexcept {
    stalls_.fetch_add(1, std::memory_order_relaxed);
    ms_.fetch_add(ms, std::memory_order_relaxed);
  }
  std::uint64_t stalls() const noexcept { return stalls_.load(std::memory_order_relaxed); }
  std::uint64_t ms() const noexcept { return ms_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint64_t kEveryMs = 2000, kTooMuchMs = 40;  // 2 %

  void tell() {
    std::uint64_t before = 0;
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, std::chrono::milliseconds(kEveryMs), [this] { return over_; })) {
      const std::uint64_t left_out = ms() - before;
      before += left_out;
      if (left_out < kTooMuchMs) continue;
      std::fprintf(stderr,
                   "farhand-mcu: this host is too slow: %llu ms of the last %llu were left out of the orthosis' time\n",
                   static_cast<unsigned long long>(left_out), static_cast<unsigned long long>(kEveryMs));
    }
  }

  std::atomic<std::uint64_t> stalls_{0}, ms_{0};
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  std::thread teller_;
};

}  // namespace farhand
