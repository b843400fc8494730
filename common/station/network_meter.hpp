// Share of the peer's packets that were lost or late, over a second, for laws that choose by it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/link/receiver.hpp"

namespace farhand {

class NetworkMeter {
 public:
  explicit NetworkMeter(double dt_s) noexcept : dt_s_(dt_s) {}

  // Once per tick. counts: if false, the packets of this tick are ignored.
  void step(const ReceiverCounters& counters, int ticks, bool counts) noexcept {
    const double missed = static_cast<double>(counters.lost + counters.late - missed_),
                 taken = static_cast<double>(counters.received - taken_);
    missed_ = counters.lost + counters.late;
    taken_ = counters.received;
    if (!counts) return;
    const double share = std::min(1.0, dt_s_ * ticks);
    missing_ += share * (missed / (dt_s_ * ticks) - missing_);
    coming_ += share * (taken / (dt_s_ * ticks) - coming_);
  }

  double loss() const noexcept { return missing_ > 0.0 ? missing_ / (missing_ + coming_) : 0.0; }

 private:
  double dt_s_;
  std::uint64_t missed_ = 0, taken_ = 0;  // packets, until the last tick
  double missing_ = 0.0, coming_ = 0.0;   // 1/s
};

}  // namespace farhand
