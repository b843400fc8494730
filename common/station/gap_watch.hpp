// What a station sees of a gap of the network: the inputs of a resumption (resumption.hpp), from its receiver and its
// axis.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/link/receiver.hpp"
#include "common/station/resumption.hpp"
#include "common/station/states.hpp"

namespace farhand {

// Where an axis was up to a second ago, to 16 ms: a gap is noticed long after it began.
template <int N>
class PastAngle {
 public:
  void step(Nanoseconds now, const Joints<N>& x) noexcept {
    if (filled_ > 0 && now - at_[newest_] < kEvery && now >= at_[newest_]) return;
    newest_ = (newest_ + 1) % kSlots;
    at_[newest_] = now;
    x_[newest_] = x;
    if (filled_ < kSlots) ++filled_;
  }
  // The newest one that is not later than `then`, else the oldest one.
  Joints<N> at(Nanoseconds then) const noexcept {
    std::size_t k = newest_;
    for (std::size_t back = 1; back < filled_ && at_[k] > then; ++back) k = (newest_ + kSlots - back) % kSlots;
    return filled_ > 0 ? x_[k] : Joints<N>(Joints<N>::Zero());
  }

 private:
  static constexpr std::size_t kSlots = 64;
  static constexpr Nanoseconds kEvery = 16 * kMillisecond;
  std::array<Nanoseconds, kSlots> at_{};
  std::array<Joints<N>, kSlots> x_{};
  std::size_t newest_ = 0, filled_ = 0;
};

template <int N>
class GapWatch {
 public:
  // session: of this station.
  explicit GapWatch(std::uint32_t session) noexcept : session_(session) {}

  // Once per tick. x: angle of this axis.
  void step(Nanoseconds now, const Joints<N>& x) noexcept { past_.step(now, x); }

  // This side holds from now on, for this reason. The gap began with the last packet that one side had of the other.
  void begin(Nanoseconds now, Reason reason, const Receiver<N>& receiver) noexcept {
    x_begin_ =
        past_.at(reason == Reason::kPeerSilent ? now - receiver.silence(now) : receiver.newest().echo_send_time_ns);
  }

  // local, remote: motion of this axis, and of the peer as shown; known: it is shown. slept: see GapInputs. The echo
  // says how long the peer has not heard this side.
  GapInputs inputs(Nanoseconds now, const Receiver<N>& receiver, const Motion<N>& local, const Motion<N>& remote,
                   bool known, bool slept) const noexcept {
    const Packet<N>& newest = receiver.newest();
    const bool echoed = newest.echo_session == session_;
    return {
        .without = std::min(receiver.silence(now), 3600 * kSecond) + (echoed ? Nanoseconds{newest.echo_dwell_ns} : 0),
        .session = newest.session,
        .told = newest.limits & kGapBits,
        .slept = slept,
        .moved = !((local.x - x_begin_).abs().maxCoeff() <= kResumedMoved),
        .near = known && (local.x - remote.x).abs().maxCoeff() <= kEngagedApart,
        .slow = (local.v.abs() < kResumedSpeed).all() && (remote.v.abs() < kResumedSpeed).all()};
  }

 private:
  std::uint32_t session_;
  PastAngle<N> past_;
  Joints<N> x_begin_ = Joints<N>::Zero();  // where this axis was when the gap began
};

}  // namespace farhand
