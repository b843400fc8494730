// Receiver: computes the present motion of the remote side from packets in any order.
//
// Order comes from sequence numbers (in a ring), time is the sender's own (play-out, see playout.hpp), and age is
// judged by arrival on the local clock. All times are relative to the first packet of a session, so that the clocks of
// the two sides may differ by any amount.
//
// A clock that steps, or a machine that was suspended, makes every packet look old or early. The echoed stamp can still
// prove that a packet is fresh, because it involves only our own clock: the excess of its transit over the fastest
// packet is at most (this round trip - shortest round trip). With that proof the clocks are compared anew, and the
// station lets go as after silence. Without it such a packet is not acted upon.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "common/link/packet.hpp"
#include "common/link/playout.hpp"
#include "common/link/receiver_params.hpp"

namespace farhand {

enum class Receipt : std::uint8_t {
  kAccepted,
  kReordered,  // accepted too: it still lies ahead of the content that is shown
  kDuplicate,
  kLate,     // it lies behind the content that is shown
  kSession,  // of a session that has been replaced
  kExpired,
  kStamp,  // its send stamp contradicts its sequence number
  kNotFinite,
};

struct ReceiverCounters {
  std::uint64_t received = 0;   // accepted, reordered ones included
  std::uint64_t reordered = 0;  // came after a newer one, but were still used
  std::uint64_t duplicate = 0;
  std::uint64_t late = 0;
  std::uint64_t lost = 0;  // gaps that play-out has passed; a packet that then comes late moves to `late`
  std::uint64_t sessions = 0;
  std::uint64_t rejected_session = 0;
  std::uint64_t rejected_expired = 0;
  std::uint64_t rejected_stamp = 0;
  std::uint64_t rejected_not_finite = 0;
};

template <int N>
struct Played {
  bool any = false;   // false until the first packet; the rest is then zero
  bool held = false;  // nothing newer has arrived: the newest is repeated
  Motion<N> motion;
  Nanoseconds depth = 0;         // play-out delay beyond the fastest packet
  Nanoseconds content_time = 0;  // sender's clock at `motion`
};

template <int N>
class Receiver {
 public:
  // own_session: session number that this station sends; echoes of another session are not used for the round trip.
  Receiver(const ReceiverParams& params, std::uint32_t own_session)
      : params_(params), own_session_(own_session), clock_(params.playout_max) {}

  Receipt accept(const Packet<N>& packet, Nanoseconds arrival) noexcept;

  // Once per tick. Content time never goes backwards within a session, except when clocks are compared anew
  // (take_lapse).
  Played<N> play(Nanoseconds now) noexcept;

  bool heard() const noexcept { return any_; }
  // The newest packet by sequence number: state and limits of the peer, its motion before play-out.
  const Packet<N>& newest() const noexcept { return newest_; }
  Nanoseconds newest_arrival() const noexcept { return newest_arrival_; }
  const ReceiverCounters& counters() const noexcept { return counters_; }

  Nanoseconds silence(Nanoseconds now) const noexcept {
    return any_ ? now - last_arrival_ : std::numeric_limits<Nanoseconds>::max();
  }
  bool alive(Nanoseconds now) const noexcept { return silence(now) <= params_.timeout; }
  // True if, since the last call, the peer was silent for too long, a clock was set, or another session took over that
  // is engaged already. It is true even if no tick fell into that time: a host that was suspended finds a socket full
  // of packets and a peer that seems alive. The station must then discard its earlier knowledge of the peer.
  bool take_lapse() noexcept { return std::exchange(lapsed_, false); }
  // True after the first second that follows silence or a restart of the peer; in that second content may jump in time,
  // unless the silence was brief.
  bool settled(Nanoseconds now) const noexcept {
    const Nanoseconds at = difference(now, arrival_0_);
    return clock_.settled(at) && at - heard_again_ >= kSecond;
  }
  // Round trip of the newest packet that echoed this station.
  std::optional<Nanoseconds> rtt() const noexcept { return rtt_; }

  // Fills the echo fields, also for packets that were too old to act upon.
  void echo(Packet<N>& outgoing, Nanoseconds now) const noexcept {
    if (!heard_) return;
    constexpr Nanoseconds kLongest = std::numeric_limits<std::uint32_t>::max();
    outgoing.echo_session = session_;
    outgoing.echo_seq = echoed_.seq;
    outgoing.echo_send_time_ns = echoed_.send_time;
    outgoing.echo_dwell_ns = static_cast<std::uint32_t>(std::clamp<Nanoseconds>(now - echoed_.arrival, 0, kLongest));
  }

 private:
  static constexpr std::int32_t kSlots = 4096;
  static constexpr Nanoseconds kHorizon = Nanoseconds{1} << 59;  // 18 years: sums of a few stay far from overflow

  struct Slot {
    std::uint32_t generation = 0;  // of the session; the ring is not cleared, old entries are recognised by this
    std::uint32_t seq = 0;
    bool arrived = false;  // false: filled from the packet after it
    bool playable = false;
    Nanoseconds stamp = 0;
    Motion<N> motion;
  };

  // Modular difference, so that no number on the wire can overflow.
  static Nanoseconds difference(Nanoseconds a, Nanoseconds b) noexcept {
    return static_cast<Nanoseconds>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  }
  static Nanoseconds sum(Nanoseconds a, Nanoseconds b) noexcept {
    return static_cast<Nanoseconds>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
  }
  static bool beyond_horizon(Nanoseconds t) noexcept { return t < -kHorizon || t > kHorizon; }
  static std::int32_t distance(std::uint32_t a, std::uint32_t b) noexcept { return static_cast<std::int32_t>(a - b); }
  static Receipt count(std::uint64_t& counter, Receipt receipt) noexcept {
    ++counter;
    return receipt;
  }

  void begin_session(const Packet<N>& packet, Nanoseconds arrival) noexcept {
    if (heard_) {
      retired_[next_retired_] = session_;
      next_retired_ = (next_retired_ + 1) % retired_.size();
      retired_count_ = std::min<std::ptrdiff_t>(retired_count_ + 1, std::ssize(retired_));
      lapsed_ = lapsed_ || packet.state == StationState::kEngaged;
    }
    heard_ = true;
    session_ = packet.session;
    ++counters_.sessions;
    echoed_ = {packet.seq, packet.send_time_ns, arrival};
    rtt_.reset();
    shortest_rtt_.reset();
    compare_clocks(packet, arrival);
  }

  // Forgets everything before this packet.
  void compare_clocks(const Packet<N>& packet, Nanoseconds arrival) noexcept {
    ++generation_;
    stamp_0_ = packet.send_time_ns;
    arrival_0_ = arrival;
    newest_seq_ = first_seq_ = packet.seq;
    any_ = played_ = false;
    overwritten_ = 0;
    heard_again_ = -kSecond;
    clock_ = PlayoutClock(params_.playout_max);
  }

  bool holds(std::uint32_t seq) const noexcept {
    const Slot& slot = ring_[seq % kSlots];
    return slot.generation == generation_ && slot.seq == seq;
  }
  bool seen(std::uint32_t seq) const noexcept { return holds(seq) && ring_[seq % kSlots].arrived; }
  Slot& take(std::uint32_t seq, bool arrived, bool playable) noexcept {
    Slot& slot = ring_[seq % kSlots];
    if (played_ && slot.generation == generation_ && slot.arrived && distance(slot.seq, cursor_) > 0) ++overwritten_;
    slot.generation = generation_;
    slot.seq = seq;
    slot.arrived = arrived;
    slot.playable = playable;
    return slot;
  }
  Slot& mark(std::uint32_t seq, bool playable) noexcept {
    if (distance(seq, newest_seq_) > 0) newest_seq_ = seq;
    return take(seq, true, playable);
  }
  // Keeps the previous sample that came with a packet, if the packet before has not come and is still of use. It still
  // counts as lost until it comes itself. A sample from before a stall of the sender is left out: it is no neighbour.
  void fill(const Packet<N>& packet, Nanoseconds stamp) noexcept {
    if (packet.previous_age_ns == 0 || packet.previous_age_ns > kPeriodMax) return;
    const std::uint32_t seq = packet.seq - 1;
    const Nanoseconds before = stamp - Nanoseconds{packet.previous_age_ns};
    if (holds(seq) || distance(seq, first_seq_) <= 0 || distance(seq, newest_seq_) <= -kSlots) return;
    if (played_ && (before <= shown_stamp_ || distance(seq, cursor_) <= 0)) return;
    Slot& slot = take(seq, false, true);
    slot.stamp = before;
    slot.motion = packet.previous;
  }
  void mark_useless(std::uint32_t seq) noexcept {
    if (played_ && distance(seq, cursor_) <= 0 && distance(seq, first_cursor_) > 0) --counters_.lost;
    mark(seq, false);
  }

  Nanoseconds expiry(const Packet<N>& packet) const noexcept {
    return packet.expiry_ms == 0 ? params_.expiry : std::min(params_.expiry, packet.expiry_ms * kMillisecond);
  }
  // Mean spacing of the stamps so far; while unknown the longest possible one.
  Nanoseconds period() const noexcept {
    const std::int32_t packets = any_ ? distance(newest_.seq, first_seq_) : 0;
    return packets > 0 ? std::clamp<Nanoseconds>(newest_stamp_ / packets, 0, kPeriodMax) : kPeriodMax;
  }

  // Moves the shown motion to `content` on the straight line between its neighbours, also across packets that never
  // came. The last shown motion serves as the left neighbour, so that a packet that arrives in between bends the line
  // and never causes a step.
  void show(Nanoseconds content) noexcept {
    const std::int64_t available = distance(newest_seq_, cursor_);  // up to the largest number of 32 bits
    const Slot* right = nullptr;
    const std::uint32_t from = cursor_;
    for (std::int64_t i = std::max<std::int64_t>(1, available - kSlots + 1); i <= available; ++i) {
      const std::uint32_t seq = from + static_cast<std::uint32_t>(i);
      const Slot& slot = ring_[seq % kSlots];
      // Stamps of an honest sender rise with the numbers; what contradicts this does not turn time back.
      if (!holds(seq) || !slot.playable || slot.stamp < shown_stamp_) continue;
      if (slot.stamp > content) {
        right = &slot;
        break;
      }
      pass(seq);
      shown_stamp_ = slot.stamp;
      shown_ = slot.motion;
    }
    if (right == nullptr || content == shown_stamp_) return;
    const double weight =
        static_cast<double>(content - shown_stamp_) / static_cast<double>(right->stamp - shown_stamp_);
    mix(shown_.x, right->motion.x, weight);
    mix(shown_.v, right->motion.v, weight);
    mix(shown_.f, right->motion.f, weight);
    shown_stamp_ = content;
  }
  void pass(std::uint32_t seq) noexcept {
    const std::int32_t steps = distance(seq, cursor_);
    const std::int32_t gone = std::clamp(distance(newest_seq_, cursor_) - kSlots, 0, steps - 1);  // from the ring
    for (std::int32_t i = gone + 1; i < steps; ++i) {
      if (!seen(cursor_ + static_cast<std::uint32_t>(i))) ++counters_.lost;
    }
    const std::int32_t arrived = std::min(overwritten_, gone);
    overwritten_ -= arrived;
    counters_.lost += static_cast<std::uint64_t>(gone - arrived) + (seen(seq) ? 0 : 1);
    cursor_ = seq;
  }
  // Two products and not a + w (b - a), which overflows for finite a and b; cut to the segment, which rounding may
  // leave.
  static void mix(Joints<N>& a, const Joints<N>& b, double weight) noexcept {
    const Joints<N> between = (1.0 - weight) * a + weight * b;
    const Joints<N> low = a.min(b), high = a.max(b);
    a = between.max(low).min(high);
  }

  std::optional<Nanoseconds> round_trip(const Packet<N>& packet, Nanoseconds arrival) const noexcept {
    constexpr std::uint32_t kSaturated = std::numeric_limits<std::uint32_t>::max();
    if (packet.echo_session == 0 || packet.echo_session != own_session_ || packet.echo_dwell_ns == kSaturated)
      return {};
    const Nanoseconds rtt =
        difference(difference(arrival, packet.echo_send_time_ns), Nanoseconds{packet.echo_dwell_ns});
    if (rtt < 0 || rtt > 120 * kSecond) return {};
    return rtt;
  }
  // True if its age beyond the fastest packet, computed from its round trip and not from clocks, is within the expiry.
  bool fresh_by_echo(const Packet<N>& packet, Nanoseconds arrival) const noexcept {
    const std::optional<Nanoseconds> rtt = round_trip(packet, arrival);
    return rtt && *rtt - shortest_rtt_.value_or(0) <= expiry(packet);
  }

  static constexpr Nanoseconds kPeriodMax = 20 * kMillisecond;
  ReceiverParams params_;
  std::uint32_t own_session_;
  PlayoutClock clock_;
  ReceiverCounters counters_;

  bool heard_ = false;  // any session
  bool any_ = false;    // anything to show
  bool played_ = false;
  bool lapsed_ = false;
  std::uint32_t session_ = 0;
  std::uint32_t generation_ = 0;
  std::array<std::uint32_t, 8> retired_{};
  std::ptrdiff_t retired_count_ = 0;
  std::size_t next_retired_ = 0;

  Nanoseconds stamp_0_ = 0;
  Nanoseconds arrival_0_ = 0;
  struct Echoed {
    std::uint32_t seq = 0;
    Nanoseconds send_time = 0, arrival = 0;
  } echoed_;  // the newest by sequence number
  std::uint32_t first_seq_ = 0;
  std::uint32_t newest_seq_ = 0;  // of everything seen, expired ones included
  Packet<N> newest_;              // of everything accepted
  Nanoseconds newest_stamp_ = 0;
  Nanoseconds newest_arrival_ = 0;
  Nanoseconds last_arrival_ = 0;
  Nanoseconds heard_again_ = -kSecond;  // after silence, relative to arrival_0_
  std::optional<Nanoseconds> rtt_, shortest_rtt_;

  std::uint32_t cursor_ = 0;  // newest packet that play-out has passed
  std::uint32_t first_cursor_ = 0;
  std::int32_t overwritten_ = 0;  // arrived, but overwritten in the ring before play-out passed it
  Nanoseconds shown_stamp_ = 0;
  Motion<N> shown_;
  std::array<Slot, kSlots> ring_{};
};

template <int N>
Receipt Receiver<N>::accept(const Packet<N>& packet, Nanoseconds arrival) noexcept {
  // Reject motion that is no number and sessions that ended; any other new session takes over.
  if (!packet.motion.finite() || !packet.previous.finite())
    return count(counters_.rejected_not_finite, Receipt::kNotFinite);
  if (!heard_ || packet.session != session_) {
    if (std::find(retired_.begin(), retired_.begin() + retired_count_, packet.session) !=
        retired_.begin() + retired_count_) {
      return count(counters_.rejected_session, Receipt::kSession);
    }
    begin_session(packet, arrival);
  }
  // Echo even a packet that is rejected below: the peer needs it to prove that it is fresh. Times relative to the
  // session's first packet.
  if (distance(packet.seq, echoed_.seq) > 0) echoed_ = {packet.seq, packet.send_time_ns, arrival};
  Nanoseconds stamp = difference(packet.send_time_ns, stamp_0_);
  Nanoseconds at = difference(arrival, arrival_0_);
  if (beyond_horizon(stamp) || beyond_horizon(at)) return count(counters_.rejected_stamp, Receipt::kStamp);

  // Order: too old for the ring, or seen before.
  const std::int32_t ahead = distance(packet.seq, newest_seq_);
  if (ahead <= -kSlots) return count(counters_.late, Receipt::kLate);
  if (seen(packet.seq)) return count(counters_.duplicate, Receipt::kDuplicate);

  // Age beyond the fastest packet: expired, unless its echo proves that only a clock was set.
  const Nanoseconds late = clock_.based() ? at - stamp - clock_.fastest(at) : 0;
  const bool early = late < -expiry(packet);
  if (late > expiry(packet) || early) {
    if (ahead > 0 && fresh_by_echo(packet, arrival)) {
      compare_clocks(packet, arrival);
      lapsed_ = true;
      stamp = at = 0;
    } else if (!early || shortest_rtt_) {  // before the first round trip an early packet is only fast
      mark_useless(packet.seq);
      return count(counters_.rejected_expired, Receipt::kExpired);
    }
  }
  // Numbers and stamps must have the same order.
  const std::int32_t ahead_of_newest = distance(packet.seq, newest_.seq);
  if (any_ && (ahead_of_newest > 0) != (stamp > newest_stamp_)) return count(counters_.rejected_stamp, Receipt::kStamp);

  // The play-out learns from every fresh packet, also from one that is too late to be shown.
  clock_.observe(stamp, at, period());
  if (played_ && (stamp <= shown_stamp_ || distance(packet.seq, cursor_) <= 0)) {
    mark_useless(packet.seq);
    return count(counters_.late, Receipt::kLate);
  }

  // Keep the motion for play-out; a packet after silence ends it as a lapse.
  Slot& slot = mark(packet.seq, true);
  slot.stamp = stamp;
  slot.motion = packet.motion;
  fill(packet, stamp);
  ++counters_.received;
  if (any_ && arrival - last_arrival_ > params_.timeout) {
    lapsed_ = true;
    heard_again_ = at;
    // The station holds: no motion follows a jump. After a brief silence the delay is most likely what it was.
    if (arrival - last_arrival_ > params_.brief) clock_.restart();
  }
  last_arrival_ = any_ ? std::max(last_arrival_, arrival) : arrival;
  if (any_ && ahead_of_newest < 0) return count(counters_.reordered, Receipt::kReordered);

  // The newest packet gives state, limits and round trip of the peer.
  any_ = true;
  newest_ = packet;
  newest_stamp_ = stamp;
  newest_arrival_ = arrival;
  if (const auto rtt = round_trip(packet, arrival)) {
    rtt_ = rtt;
    shortest_rtt_ = std::min(*rtt, shortest_rtt_.value_or(*rtt));
  }
  return Receipt::kAccepted;
}

template <int N>
Played<N> Receiver<N>::play(Nanoseconds now) noexcept {
  if (!any_) return {};
  const Nanoseconds offset = clock_.advance(difference(now, arrival_0_));
  Nanoseconds content = difference(now, arrival_0_) - offset;
  if (!played_) {
    cursor_ = first_cursor_ = newest_.seq;
    shown_stamp_ = newest_stamp_;
    shown_ = newest_.motion;
    played_ = true;
  }
  content = std::max(content, shown_stamp_);
  const bool held = content > newest_stamp_;
  show(content);
  return {.any = true,
          .held = held,
          .motion = shown_,
          .depth = clock_.depth(),
          .content_time = sum(stamp_0_, shown_stamp_)};
}

extern template class Receiver<1>;  // receiver.cpp: compiled once

}  // namespace farhand
