// May a common motion that a short gap of the network ended go on without an act? Each side decides by its own
// knowledge; both must agree.
//
// The two sides were Engaged together, and one of them has heard nothing for `receive.timeout_s`. Since then:
//
//   no act on this side; no limit, shaking, stop, fault or other change of state on either side
//   the peer is of the same session; no host has slept, no clock was set
//   neither side was without the other for longer than `engagement.resume_s`
//   this hand has not moved by more than 3 degrees since the last packet before the gap
//
// And now: the hands are within 5 degrees of each other and slower than 0.3 rad/s, within a second after the gap. Three
// resumptions in a minute are the most, whatever the peer says: a network that fails more often, or somebody who cuts
// it in a rhythm, needs an operator.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/link/packet.hpp"

namespace farhand {

// rad, 5 degrees: hands that are further apart do not engage, whatever the peer sends.
inline constexpr double kEngagedApart = 0.0873;
inline constexpr double kResumedMoved = 0.0524;  // rad, 3 degrees: a person who moved on may mean to stop
inline constexpr double kResumedSpeed = 0.3;     // rad/s, the usual speed of aligning
inline constexpr double kSlept = 0.1;            // s: a host that missed its ticks for so long has slept

struct GapInputs {
  Nanoseconds without = 0;    // longest time for which one side has not heard the other
  std::uint32_t session = 0;  // of the peer's newest packet
  std::uint32_t told = 0;     // GapBit, by that packet
  bool slept = false;         // a host missed its ticks for kSlept before this one, or a clock was set
  bool moved = false;         // this hand, by more than kResumedMoved
  bool near = false;          // hands within kEngagedApart, by the motion that is shown of the peer
  bool slow = false;          // both, below kResumedSpeed
};

class Resumption {
 public:
  explicit Resumption(Nanoseconds longest) noexcept : longest_(longest) {}

  // The gap was noticed; the side holds from now on.
  void begin(Nanoseconds now, const GapInputs& in) noexcept {
    waits_ = longest_ > 0 && !in.slept && in.without <= longest_ && count_of_minute(now) < kMost;
    ready_ = resumes_ = false;
    begun_ = now;
    session_ = in.session;
  }
  // While it holds, once per tick. spoilt: something happened on one of the sides, see above. heard: the peer is.
  void hold(Nanoseconds now, const GapInputs& in, bool spoilt, bool heard) noexcept {
    waits_ = waits_ && !spoilt && !in.slept && !in.moved && in.without <= longest_ && in.session == session_ &&
             now - begun_ <= longest_ + kAfterwards;
    ready_ = waits_ && heard && in.near && in.slow;
  }
  void take(Nanoseconds now) noexcept {
    last_[next_] = now;
    next_ = (next_ + 1) % kMost;
    ++count_;
    waits_ = ready_ = false;
    resumes_ = true;
  }
  void end() noexcept { waits_ = ready_ = resumes_ = false; }

  bool waits() const noexcept { return waits_; }      // holds for the gap alone
  bool ready() const noexcept { return ready_; }      // and would go on now
  bool resumes() const noexcept { return resumes_; }  // goes on, until end()
  // So many in the last minute.
  std::size_t count_of_minute(Nanoseconds now) const noexcept {
    std::size_t recent = 0;
    for (std::size_t k = 0; k < kMost && k < count_; ++k) recent += now - last_[k] <= kMinute ? 1 : 0;
    return recent;
  }

 private:
  static constexpr std::size_t kMost = 3;
  static constexpr Nanoseconds kMinute = 60 * kSecond;
  static constexpr Nanoseconds kAfterwards = kSecond;  // two round trips of 0.3 s, and aligning over 5 degrees
  Nanoseconds longest_;
  Nanoseconds begun_ = 0;
  std::uint32_t session_ = 0;
  bool waits_ = false, ready_ = false, resumes_ = false;
  std::array<Nanoseconds, kMost> last_{};
  std::size_t next_ = 0, count_ = 0;
};

}  // namespace farhand
