#include "netem/lab/rogue_peer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farhand::rogue {
namespace {

constexpr double kSettled = 1.03;  // s; before, nobody engages with a new session
constexpr double kTick = 1e-3;
constexpr double kLargest = 1.7e308;
constexpr Nanoseconds kPeerEpoch = 5'000 * kSecond;

double finite(double value) {
  return std::isfinite(value) ? value : std::copysign(kLargest, std::isnan(value) ? 1.0 : value);
}
double sign(double value) { return value < 0 ? -1.0 : 1.0; }

}  // namespace

Peer::Peer(const Plan& plan, Against against, std::uint64_t seed) : plan_(plan), against_(against), dice_(seed) {
  out_.reserve(512);
  kept_.reserve(512);
}

void Peer::begin_segment(std::size_t k) {
  segment_ = k;
  segment_from_s_ = seen_.t_s;
  segment_start_ = seen_;
}

void Peer::move_on() {
  const Segment& s = plan_.segments[segment_];
  const double here = seen_.t_s - segment_from_s_;
  const Seen& before = past_[(ticks_ + kPast - 1) % kPast];
  bool over = here >= s.duration_s;
  switch (s.until) {
    case Until::kTurns:
      over = over || (here > 5e-3 && seen_.v * before.v < 0);
      break;
    case Until::kFast:
      over = over || (here > 2e-3 && std::fabs(seen_.v) > 2.5);
      break;
    case Until::kFar:
      over = over || (here > 2e-3 && std::fabs(seen_.x) > 0.25);
      break;
    case Until::kPressed:
      over = over || (here > 2e-3 && std::fabs(seen_.f) > 1.5);
      break;
    default:
      break;
  }
  if (!over) return;
  if (segment_ + 1 < kSegments) {
    begin_segment(segment_ + 1);
  } else if (plan_.repeats) {
    begin_segment(0);
  }
}

double Peer::shape_of(const Channel& c) {
  const double t = seen_.t_s - segment_from_s_, turns = c.hz * t + c.phase;
  const Seen& then = past_[(ticks_ + kPast - static_cast<std::size_t>(c.lag)) % kPast];
  switch (c.shape) {
    case Shape::kConstant:
      return 1.0;
    case Shape::kSquare:
      return turns - std::floor(turns) < 0.5 ? 1.0 : -1.0;
    case Shape::kSine:
      return std::sin(2 * std::numbers::pi * turns);
    case Shape::kChirp:
      return std::sin(2 * std::numbers::pi * (c.phase + c.hz * t * (0.2 + t)));
    case Shape::kEdge:
      return t < c.phase * 0.3 ? -1.0 : 1.0;
    case Shape::kRamp:
      return t * c.hz;
    case Shape::kNoise:
      return 2 * uniform(dice_) - 1;
    case Shape::kPulse:
      return turns - std::floor(turns) < 0.1 ? 1.0 : 0.0;
    case Shape::kWithSpeed:
      return sign(then.v);
    case Shape::kWithAngle:
      return sign(then.x - 0.3 * (c.phase - 0.5));
    case Shape::kWithTorque:
      return sign(then.f);
    default:
      return t < c.phase * 0.3 ? 0.0 : 1.0;
  }
}

double Peer::say(const Channel& c, double now, double at_start, double legal) {
  double base = 0;
  if (c.base == Base::kNow) base = now;
  if (c.base == Base::kAtStart) base = at_start;
  if (c.base == Base::kMirror) base = -now;
  double value = finite(base + c.amplitude * shape_of(c));
  return plan_.legal ? std::clamp(value, -legal, legal) : value;
}

Motion<1> Peer::honest() const {
  Motion<1> m{};
  m.x[0] = std::clamp(seen_.x + plan_.engage_offset, -0.349, 0.349);
  m.v[0] = 0;
  m.f[0] = 0;
  return m;
}

// What a peer must say so that the other side engages: the leader says Ready, then Engaged; a box says Ready until the
// therapist's station is engaged.
StationState Peer::wanted_state() {
  const StationState apart = after_gap() ? StationState::kHolding : StationState::kReady;
  if (against_ == Against::kTherapist) return seen_.state == StationState::kEngaged ? StationState::kEngaged : apart;
  const bool settled = seen_.t_s >= kSettled;
  if (!settled) return StationState::kReady;
  if (!plan_.engages_again || disengaged_from_s_ < 0) return StationState::kEngaged;
  const double since = seen_.t_s - disengaged_from_s_;  // an edge every 60 ms
  return std::fmod(since, 0.06) < 0.03 ? apart : StationState::kEngaged;
}

// The other side would go on after a gap of the network: so would the peer, whatever it was that made the gap.
bool Peer::after_gap() const { return plan_.claims_gaps && (seen_.packet.limits & kGapHeld) != 0; }

void Peer::post(Packet<1> packet) {
  packet.motion.x[0] = finite(packet.motion.x[0]);
  packet.motion.v[0] = finite(packet.motion.v[0]);
  packet.motion.f[0] = finite(packet.motion.f[0]);
  packet.energy = finite(packet.energy);
  packet.friction = finite(packet.friction);
  out_.push_back(packet);
}

const std::vector<Packet<1>>& Peer::tick(const Seen& seen) {
  out_.clear();
  seen_ = seen;
  past_[ticks_ % kPast] = seen;
  const bool engaged = seen.state == StationState::kEngaged;
  if (engaged && engaged_from_s_ < 0) engaged_from_s_ = seen.t_s;
  if (engaged) {
    disengaged_from_s_ = -1;
  } else if (engaged_from_s_ >= 0 && disengaged_from_s_ < 0) {
    disengaged_from_s_ = seen.t_s;
  }

  const bool wants = seen.t_s >= kSettled;
  const bool begins = plan_.attack_from == 0 ? engaged : plan_.attack_from == 1 ? wants : true;
  if (begins && !attacks_) {
    attacks_ = true;
    begin_segment(0);
  } else if (attacks_) {
    move_on();
  }
  // Once thrown out, it behaves until it is let in again.
  const bool again = attacks_ && plan_.engages_again && disengaged_from_s_ >= 0 && seen.t_s - disengaged_from_s_ > 0.03;
  const bool speaks_freely = attacks_ && !again;

  const Segment& s = plan_.segments[segment_];
  Packet<1> packet;
  packet.state = wanted_state();
  packet.motion = honest();
  packet.expiry_ms = 2000;
  if (plan_.claims_gaps) packet.limits = after_gap() ? kGapHeld | kGapOver : kGapHeld;
  energy_ += 2.0 * kTick;
  if (speaks_freely) {
    packet.motion.x[0] = say(s.x, seen.x, segment_start_.x, 0.349);
    packet.motion.v[0] = say(s.v, seen.v, segment_start_.v, 4.0);
    packet.motion.f[0] = say(s.f, -seen.f, -segment_start_.f, 3.0);
    packet.friction = packet.motion.f[0];
    packet.friction_known = true;
    if (s.velocity_of_x && said_) packet.motion.v[0] = finite((packet.motion.x[0] - x_said_) / kTick);
    if (plan_.legal) packet.motion.v[0] = std::clamp(packet.motion.v[0], -4.0, 4.0);
    if (plan_.attack_from == 0 || engaged) {
      packet.state = s.state;
      if (s.flap_hz > 0 && std::fmod((seen.t_s - segment_from_s_) * s.flap_hz, 1.0) >= 0.5) packet.state = s.other;
    }
    energy_ = finite(energy_ + (s.energy_w - 2.0) * kTick);
  }
  x_said_ = packet.motion.x[0];
  said_ = true;

  // Last words.
  const bool over = engaged_from_s_ >= 0 && seen.t_s >= engaged_from_s_ + plan_.attack_s;
  if (over && plan_.falls_silent) {
    if (plan_.last.any && last_words_ < plan_.last.packets) {
      ++last_words_;
      packet.motion.x[0] = plan_.last.x;
      packet.motion.v[0] = plan_.last.v;
      packet.motion.f[0] = plan_.last.f;
      packet.state = plan_.last.state;
    } else {
      silent_ = true;
    }
  }
  ++ticks_;
  if (silent_) return out_;

  packet.session = session_;
  packet.seq = ++seq_;
  packet.energy = energy_;
  if (speaks_freely) {
    switch (s.numbers) {
      case Numbers::kRepeats:
        if (uniform(dice_) < 0.3) packet.seq = --seq_;
        break;
      case Numbers::kJumps:
        if (uniform(dice_) < 0.02) packet.seq = seq_ += 1000;
        break;
      case Numbers::kBackwards:
        if (uniform(dice_) < 0.2) packet.seq = seq_ - 20;
        break;
      case Numbers::kNewSession:
        if (uniform(dice_) < 0.02) packet.session = ++session_;
        break;
      default:
        break;
    }
    switch (s.stamps) {
      case Stamps::kFastClock:
        stamp_off_s_ += 0.3 * s.stamp_by * kTick;
        break;
      case Stamps::kSlowClock:
        stamp_off_s_ -= 0.3 * s.stamp_by * kTick;
        break;
      case Stamps::kAhead:
        if (std::fabs(stamp_off_s_) < s.stamp_by) stamp_off_s_ += s.stamp_by;
        break;
      case Stamps::kJumps:
        if (uniform(dice_) < 0.02) stamp_off_s_ += s.stamp_by * (2 * uniform(dice_) - 1);
        break;
      case Stamps::kSame:
        stamp_off_s_ -= kTick;
        break;
      default:
        break;
    }
  }
  packet.send_time_ns = kPeerEpoch + from_seconds(seen.t_s + stamp_off_s_);
  packet.echo_session = seen.packet.session;
  packet.echo_seq = seen.packet.seq;
  packet.echo_send_time_ns = seen.packet.send_time_ns;
  packet.echo_dwell_ns = 0;
  if (speaks_freely) {
    switch (s.echoes) {
      case Echoes::kNone:
        packet.echo_session = packet.echo_seq = 0;
        break;
      case Echoes::kWrongSession:
        packet.echo_session ^= 1;
        break;
      case Echoes::kFuture:
        packet.echo_send_time_ns += from_seconds(s.stamp_by);
        break;
      case Echoes::kLong:
        packet.echo_send_time_ns -= from_seconds(s.stamp_by);
        break;
      default:
        break;
    }
    const double beat = std::fmod(seen.t_s - segment_from_s_, 2 * s.gap_s);
    switch (s.rhythm) {
      case Rhythm::kGaps:
        if (beat < s.gap_s) return out_;
        break;
      case Rhythm::kBursts:
        if (beat < s.gap_s && kept_.size() < 300) {
          kept_.push_back(packet);
          return out_;
        }
        for (const Packet<1>& kept : kept_) post(kept);
        kept_.clear();
        break;
      case Rhythm::kSparse:
        if (std::fmod(beat, 0.1 * s.gap_s + 2 * kTick) >= kTick) return out_;
        break;
      case Rhythm::kDouble:
        post(packet);
        break;
      default:
        break;
    }
  }
  post(packet);
  last_packet_s_ = seen.t_s;
  return out_;
}

}  // namespace farhand::rogue
