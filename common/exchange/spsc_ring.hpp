// A ring of fixed size between one thread that must never wait and one thread that may. push neither locks, waits nor
// allocates; it returns false if there is no room.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace farhand {

template <class T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "a copy in the loop thread must not allocate");

 public:
  explicit SpscRing(std::size_t at_least) : slots_(std::bit_ceil(at_least)) {}

  // Producer thread only.
  bool push(const T& item) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[tail & (slots_.size() - 1)] = item;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // Consumer thread only.
  bool pop(T& item) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    item = slots_[head & (slots_.size() - 1)];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> head_{0};  // next to pop; counts up for ever, wraps without harm
  alignas(64) std::atomic<std::size_t> tail_{0};  // next to push
};

}  // namespace farhand
