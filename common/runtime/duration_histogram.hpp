// Histogram of durations over a whole session, in constant memory. The loop adds one value per tick and may not
// allocate; therefore values go into fixed logarithmic buckets, 128 per octave. A quantile is at most 1/128 above the
// true one. The maximum is exact.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "common/signal/joints.hpp"

namespace farhand {

class DurationHistogram {
 public:
  // A clock that steps back would give a negative duration; it counts as 0.
  void add(Nanoseconds duration) noexcept {
    const auto value = static_cast<std::uint64_t>(std::max<Nanoseconds>(duration, 0));
    ++counts_[bucket(value)];
    ++count_;
    max_ = std::max(max_, value);
  }

  std::uint64_t count() const noexcept { return count_; }
  Nanoseconds max() const noexcept { return static_cast<Nanoseconds>(max_); }

  // The smallest bucket edge that at least the share `q` (0..1) of all values does not exceed; 0 while empty.
  Nanoseconds quantile(double q) const noexcept {
    const double wanted = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i + 1 < counts_.size(); ++i) {
      seen += counts_[i];
      if (seen > 0 && static_cast<double>(seen) >= wanted)
        return static_cast<Nanoseconds>(std::min(upper_edge(i), max_));
    }
    return max();  // the last bucket is open above
  }

 private:
  static constexpr std::size_t kPerOctave = 128;  // values below it have a bucket each
  static constexpr int kOctaveBits = 7;
  static constexpr int kTopBit = 40;  // 2^40 ns = 18 minutes; longer ones share the last bucket

  static constexpr std::size_t bucket(std::uint64_t value) noexcept {
    if (value < kPerOctave) return static_cast<std::size_t>(value);
    value = std::min(value, (std::uint64_t{1} << kTopBit) - 1);
    const int octave = static_cast<int>(std::bit_width(value)) - 1 - kOctaveBits;
    return kPerOctave * static_cast<std::size_t>(octave) + static_cast<std::size_t>(value >> octave);
  }

  static constexpr std::uint64_t upper_edge(std::size_t i) noexcept {
    if (i < 2 * kPerOctave) return i;
    const std::size_t octave = i / kPerOctave - 1;
    return ((i - kPerOctave * octave + 1) << octave) - 1;
  }

  std::array<std::uint64_t, kPerOctave*(kTopBit - kOctaveBits + 1)> counts_{};
  std::uint64_t count_ = 0;
  std::uint64_t max_ = 0;
};

}  // namespace farhand
