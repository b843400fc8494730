// How often did this thread touch the heap or a mutex? The promise that a tick does neither is checked by a machine.
// Two forms of one source: linked into a test (farhand_alloc_counter), or preloaded into the real programs
// (libfarhand_count.so), where the run loop says when its first tick is over and the totals of its thread are printed
// at its end.
#pragma once

#include <cstdint>

namespace farhand {

// The sanitizers bring their own malloc and mutexes: nothing can be counted below them, and tests of counts are skipped
// by name.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kCounterIsBlind = true;
#else
inline constexpr bool kCounterIsBlind = false;
#endif

struct Touched {
  std::uint64_t heap = 0;   // malloc, calloc, realloc, aligned forms, free; operator new and delete end there too
  std::uint64_t locks = 0;  // pthread_mutex_lock, hence std::mutex

  bool operator==(const Touched&) const = default;
};

// Of the calling thread, since it began.
Touched touched() noexcept;

// Of the calling thread, since construction.
class TouchCounter {
 public:
  Touched since() const noexcept {
    const Touched now = touched();
    return {now.heap - start_.heap, now.locks - start_.locks};
  }

 private:
  Touched start_ = touched();
};

}  // namespace farhand
