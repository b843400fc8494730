// Decides which moment of the sender is shown now. Content time = now - offset, with one slowly moving offset, so that
// irregular arrival becomes a constant delay and the shown velocity stays that of the sender.
//
//   transit e = (first tick at which a packet can be shown) - (its send stamp)
//   offset -> upper end of e,   base -> lower end of e,   depth = offset - base
//
// The two clocks are never compared: e contains their difference.
//
// e counts from ticks and not from arrivals, because content is only asked for at ticks: two stations with equal
// periods then play each packet exactly, whatever the phase between their ticks.
//
// Upper end: the median, over 16 buckets of 0.25 s, of the largest e in a bucket. With independent delays at 1 kHz that
// is the 1 - ln2/250 = 99.7 % quantile: all but 0.3 % of the range for uniform jitter, 2.8 sigma for normal jitter. A
// later packet is bridged by interpolation like a lost one; to wait for the maximum of a normal delay would only add
// delay. The median ignores spikes rarer than one in 0.5 s. A permanent rise of the delay appears in the smallest of
// the newest four buckets, after 1 s.
//
// Lower end: the running minimum. It is the second smallest of the bucket minima, so that a single wrong stamp has no
// effect; their median would lie 1/250 of the range too high. It may rise by at most kSkewMax, which follows any real
// clock; a queue that builds up is faster and is not taken for a clock. Skew needs no estimate of its own: the window
// follows it with a lag of 2 to 4 s, 0.8 ms at 200 ppm.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "common/signal/joints.hpp"

namespace farhand {

class PlayoutClock {
 public:
  // Bounds on the time warp d(offset)/d(now) after the first second: shown motion is at most 1 % fast and 5 % slow.
  // Only depth_max overrides them: if the fastest transit drops by more than that (the clock of the peer was set), the
  // content jumps.
  static constexpr Nanoseconds kWarpFast = 100;  // 1/100
  static constexpr Nanoseconds kWarpSlow = 20;   // 1/20
  static constexpr Nanoseconds kSkewMax = 1000;  // 1/1000

  explicit PlayoutClock(Nanoseconds depth_max) : depth_max_(depth_max) {}

  // No motion is being shown that a jump could disturb: the offset may jump again for one second. The base stays.
  void restart() noexcept { running_ = false; }

  // For each packet, also if it is too late to be shown. `period`: mean spacing of stamps. A packet waits no longer
  // than this for a tick, unless the receiver itself stalled, which does not belong to the link.
  void observe(Nanoseconds stamp, Nanoseconds arrival, Nanoseconds period) noexcept {
    const Nanoseconds latest = arrival - stamp + period;
    fresh_.stamp.include(stamp);
    fresh_.latest.include(latest);
  }

  // Once per tick; returns the offset. Needs at least one observe() before.
  Nanoseconds advance(Nanoseconds now) noexcept {
    Range e;
    if (!fresh_.stamp.empty()) {
      e.include(std::min(now - fresh_.stamp.high, fresh_.latest.low));
      e.include(std::min(now - fresh_.stamp.low, fresh_.latest.high));
      fresh_ = {};
    }
    if (!running_) start(now, e);
    bucket_.include(e);

    const bool starting = now - start_ < kStart;
    if (now - bucket_start_ >= (starting ? kStart / Nanoseconds{kBuckets} : kBucket)) close_bucket(now);
    if (starting) {
      offset_ = std::max(highest_of_newest(3), bucket_.empty() ? kLow : bucket_.high);
      if (!bucket_.empty()) base_ = std::min(base_, bucket_.low);
    } else {
      slew(std::clamp<Nanoseconds>(now - last_, 0, kSecond));
    }
    offset_ = std::min(offset_, base_ + depth_max_);
    last_ = now;
    return offset_;
  }

  Nanoseconds depth() const noexcept { return std::max<Nanoseconds>(offset_ - base_, 0); }
  // Smallest transit that the clocks allow at `now`.
  Nanoseconds fastest(Nanoseconds now) const noexcept {
    return base_ + std::max<Nanoseconds>(now - base_time_, 0) / kSkewMax;
  }
  // True once the offset may no longer jump: from now on content keeps the bounds above.
  bool settled(Nanoseconds now) const noexcept { return running_ && now - start_ >= kStart; }
  // True once fastest() is valid.
  bool based() const noexcept { return based_; }

 private:
  static constexpr Nanoseconds kLow = std::numeric_limits<Nanoseconds>::min() / 4;
  static constexpr Nanoseconds kHigh = std::numeric_limits<Nanoseconds>::max() / 4;
  static constexpr Nanoseconds kStart = kSecond;
  static constexpr Nanoseconds kBucket = kSecond / 4;
  static constexpr std::size_t kBuckets = 16;

  struct Range {
    Nanoseconds low = kHigh;
    Nanoseconds high = kLow;
    bool empty() const noexcept { return low > high; }
    void include(Nanoseconds value) noexcept {
      low = std::min(low, value);
      high = std::max(high, value);
    }
    void include(const Range& other) noexcept {
      low = std::min(low, other.low);
      high = std::max(high, other.high);
    }
  };
  struct Fresh {
    Range stamp, latest;
  };

  // The newest packet is shown at once. Packets that queued up before the first tick do not show the delay of the link
  // and are ignored.
  void start(Nanoseconds now, Range& e) noexcept {
    const Nanoseconds first = e.empty() ? offset_ : e.low;
    if (!e.empty()) e.high = e.low;
    base_ = based_ ? std::min(fastest(now), first) : first;
    based_ = running_ = true;
    base_time_ = start_ = bucket_start_ = last_ = now;
    offset_ = target_ = first;
    bucket_ = {};
    bucket_.include(first);
    filled_ = next_ = 0;
  }

  void close_bucket(Nanoseconds now) noexcept {
    bucket_start_ = now;
    if (bucket_.empty()) return;
    buckets_[next_] = bucket_;
    next_ = (next_ + 1) % kBuckets;
    filled_ = std::min(filled_ + 1, kBuckets);
    bucket_ = {};

    std::array<Nanoseconds, kBuckets> low, high;
    for (std::size_t i = 0; i < filled_; ++i) {
      low[i] = buckets_[i].low;
      high[i] = buckets_[i].high;
    }
    const auto middle = static_cast<std::ptrdiff_t>(filled_ / 2);
    const auto second = std::min<std::ptrdiff_t>(middle, 1);
    std::nth_element(low.begin(), low.begin() + second, low.begin() + static_cast<std::ptrdiff_t>(filled_));
    std::nth_element(high.begin(), high.begin() + middle, high.begin() + static_cast<std::ptrdiff_t>(filled_));
    target_ = high[static_cast<std::size_t>(middle)];
    if (filled_ >= kNewest) {
      Nanoseconds lasting = kHigh;
      for (std::size_t back = 1; back <= kNewest; ++back) lasting = std::min(lasting, newest(back).high);
      target_ = std::max(target_, lasting);
    }
    base_ = std::min(fastest(now), low[static_cast<std::size_t>(second)]);
    base_time_ = now;
  }

  void slew(Nanoseconds dt) noexcept {
    const Nanoseconds excess = offset_ - target_;
    if (excess < 0) {
      offset_ += std::min(-excess, dt / kWarpSlow);
    } else if (dt > 0) {
      // Slowly down, in proportion with 10 s, but never slower than a clock can drift.
      const Nanoseconds step = std::clamp(excess / (10 * kSecond / dt), dt / kSkewMax, dt / kWarpFast);
      offset_ -= std::min(excess, step);
    }
  }

  const Range& newest(std::size_t back) const noexcept { return buckets_[(next_ + kBuckets - back) % kBuckets]; }
  Nanoseconds highest_of_newest(std::size_t count) const noexcept {
    Nanoseconds high = kLow;
    for (std::size_t back = 1; back <= std::min(count, filled_); ++back) high = std::max(high, newest(back).high);
    return high;
  }

  static constexpr std::size_t kNewest = 4;
  Nanoseconds depth_max_;
  bool running_ = false;
  bool based_ = false;
  Nanoseconds offset_ = 0;
  Nanoseconds target_ = 0;
  Nanoseconds base_ = 0;
  Nanoseconds base_time_ = 0;
  Nanoseconds start_ = 0;
  Nanoseconds last_ = 0;
  Nanoseconds bucket_start_ = 0;
  Fresh fresh_;
  Range bucket_;
  std::array<Range, kBuckets> buckets_{};
  std::size_t next_ = 0;
  std::size_t filled_ = 0;
};

}  // namespace farhand
