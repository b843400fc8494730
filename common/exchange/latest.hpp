// Hands the newest value from one thread to another; neither thread ever waits. Of three slots the writer owns one and
// the reader one; the third changes hands by one atomic exchange. Older values are overwritten on purpose. There must
// be exactly one writer and one reader.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace farhand {

template <class T>
class Latest {
  static_assert(std::is_trivially_copyable_v<T>, "a value that allocates would bring the heap into the loop");

 public:
  void write(const T& value) noexcept {
    slots_[back_] = value;
    // acq_rel: the value is visible before its index is, and the slot we get back is no longer read.
    back_ = shared_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
  }

  // Returns false and leaves `value` unchanged if no value was written since the last read.
  bool read(T& value) noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = shared_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    value = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kFresh = 4;

  std::array<T, 3> slots_{};
  std::uint32_t back_ = 0;  // writer's
  std::atomic<std::uint32_t> shared_{1};
  std::uint32_t front_ = 2;  // reader's
};

}  // namespace farhand
