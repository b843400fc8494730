// A whole number of samples of delay, of fixed capacity.
#pragma once

#include <array>
#include <cstddef>

namespace farhand {

template <class T, std::size_t Capacity>
class DelayLine {
 public:
  // samples < Capacity; larger values are cut to Capacity - 1. The first `samples` outputs are `initial`.
  explicit DelayLine(std::size_t samples, const T& initial = T{})
      : samples_(samples < Capacity ? samples : Capacity - 1) {
    reset(initial);
  }

  // Takes u(k), returns u(k - samples).
  const T& step(const T& u) noexcept {
    ring_[head_] = u;
    const std::size_t tail = (head_ + Capacity - samples_) % Capacity;
    head_ = (head_ + 1) % Capacity;
    return ring_[tail];
  }
  void reset(const T& value) noexcept { ring_.fill(value); }
  std::size_t samples() const noexcept { return samples_; }

 private:
  std::array<T, Capacity> ring_{};
  std::size_t samples_;
  std::size_t head_ = 0;
};

}  // namespace farhand
