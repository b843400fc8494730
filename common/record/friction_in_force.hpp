// What the box takes for the friction of its device, from tick to tick.
#pragma once

#include "common/record/session.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

class FrictionInForce {
 public:
  FrictionInForce() = default;
  explicit FrictionInForce(const DeviceFriction& at_start) noexcept : now_(at_start) {}

  // After each tick of the box. utc_s: its time. True where a sweep has just measured the friction.
  bool step(const TickTrace<1>& trace, std::int64_t utc_s) noexcept {
    const bool swept = state_ == StationState::kSweeping && trace.state != state_ && trace.reason == Reason::kSwept;
    state_ = trace.state;
    now_.threshold_nm = trace.friction.threshold;
    now_.measured = trace.friction.known;
    if (swept) {
      now_.F_c_nm = trace.swept.F_c;
      now_.spread_nm = trace.swept.spread;
      now_.swept_utc_s = utc_s;
    }
    return swept;
  }
  const DeviceFriction& now() const noexcept { return now_; }

 private:
  DeviceFriction now_;
  StationState state_ = StationState::kOff;
};

}  // namespace farhand
