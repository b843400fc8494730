// What is left when everything that a scene of plain four channels on a motor does not need is cut away by hand: a
// station that never had a place for a CDOB, an SDCV, weight or dry friction. None of their headers is included here.
// tests/explain_test.cpp holds these to the same numbers, bench/zero_cost_bench.cpp compares the time.
#pragma once

#include "common/law/acceleration_law.hpp"
#include "common/link/codec.hpp"
#include "common/link/receiver.hpp"
#include "common/station/blend.hpp"
#include "common/station/drive.hpp"
#include "common/station/engagement.hpp"

namespace farhand::cut {

// RTOB of an axis on which nothing but viscous friction is known.
class Rtob {
 public:
  Rtob(const AxisModel& model, Cutoff g, double dt_s) : viscous_(model.viscous), observer_(model.J_n, g, dt_s) {}
  const Joints<1>& step(const Joints<1>& tau_applied, const Joints<1>& v) noexcept {
    return observer_.step(tau_applied - viscous_ * v, v);
  }
  void reset() noexcept { observer_.reset(Joints<1>::Zero(), Joints<1>::Zero()); }

 private:
  double viscous_;
  Dob<1> observer_;
};

// Its steps are not inlined, as those of the real one are not.
class Drive {
 public:
  explicit Drive(const DriveParams& p)
      : J_n_(p.model.J_n),
        K_(p.K),
        derivative_(p.g_v, p.dt_s),
        dob_(p.model.J_n, p.g_dis, p.dt_s),
        rtob_(p.model, p.g_reac, p.dt_s),
        gate_(p.gate, p.dt_s),
        rise_(p.dt_s / p.take_over_s),
        fall_(p.dt_s / 0.2) {}

  void reset(const Joints<1>& x) noexcept {
    derivative_.reset(x);
    dob_.reset(Joints<1>::Zero(), Joints<1>::Zero());
    rtob_.reset();
  }
  [[gnu::noinline]] Motion<1> observe(const Joints<1>& x, int ticks) noexcept {
    Motion<1> local;
    local.x = x;
    local.v = ticks > 1 ? derivative_.across(x, ticks) : derivative_.step(x);
    dob_.step(gate_.applied(), local.v);
    local.f = rtob_.step(gate_.applied(), local.v);
    return local;
  }
  [[gnu::noinline]] Joints<1> follow(const Motion<1>& local, const Motion<1>& target, bool driven, int ticks) noexcept {
    authority_ = std::clamp(authority_ + (driven ? rise_ : -fall_) * ticks, 0.0, 1.0);
    return gate_.pass(authority_ * (J_n_ * four_channel(K_, local, target) + dob_.value()), local.x);
  }
  Joints<1> safe() noexcept {
    authority_ = 0.0;
    return gate_.cut();
  }
  bool at_rest() const noexcept { return gate_.applied()[0] == 0.0; }
  std::uint32_t active_limits() const noexcept { return gate_.active(); }

 private:
  double J_n_;
  FourChannelGains K_;
  Derivative<1> derivative_;
  Dob<1> dob_;
  Rtob rtob_;
  TorqueGate<1> gate_;
  double rise_, fall_, authority_ = 0.0;
};

struct Params {
  Role role;
  DriveParams drive;
  ReceiverParams receive;
  EngagementParams engagement;
  double align_speed, align_tolerance, blend_s;
  std::uint32_t session, expiry_ms;
};

// From the settings of a whole station. A template, so that this file needs not know them.
template <class StationParams>
Params params_of(const StationParams& p) {
  return {p.role,    p.control.drive, p.receive,  p.engagement, p.align_speed, p.align_tolerance,
          p.blend_s, p.session,       p.expiry_ms};
}

// Copy: the same code once more, elsewhere in the program.
template <int Copy = 0>
class Station {
 public:
  struct Output {
    Joints<1> torque;
    Packet<1> packet;
  };

  explicit Station(const Params& p)
      : p_(p),
        drive_(p.drive),
        receiver_(p.receive, p.session),
        engagement_(p.role, p.engagement),
        blend_(p.blend_s, p.align_speed) {}

  Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept { return receiver_.accept(packet, now); }

  // Not inlined, as the real one is not.
  [[gnu::noinline]] Output tick(Nanoseconds now, const Joints<1>& x, bool valid, OperatorAct act, int ticks) noexcept {
    const bool finite = x.allFinite(), usable = valid && finite;
    Motion<1>& local = trace_.local;
    if (usable) {
      if (!was_usable_) drive_.reset(x);
      local = drive_.observe(x, ticks);
    }
    was_usable_ = usable;
    const Played<1> played = receiver_.play(now);
    trace_.remote = played.any ? played.motion : own_motion();
    trace_.playout_depth = played.depth;
    trace_.rtt = receiver_.rtt().value_or(0);
    decide(now, valid, finite, act, played.any);
    const Motion<1> source = choose();
    const Asks asks = asks_of(trace_.state);
    if (asks == Asks::kNothing) {
      trace_.target = source;
    } else {
      const bool elsewhere = changed_ || leapt(source, ticks);
      if (elsewhere) blend_.begin(trace_.target, source);
      trace_.target = blend_.step(source, elsewhere ? 0.0 : p_.drive.dt_s * ticks);
    }
    x_source_ = source.x;
    Output out;
    out.torque = usable && asks != Asks::kNothing ? drive_.follow(local, trace_.target, asks == Asks::kMotion, ticks)
                                                  : drive_.safe();
    trace_.limits = drive_.active_limits() | (finite ? 0u : kLimitNotFinite);
    trace_.effort = out.torque[0];
    fill(out.packet, now);
    return out;
  }

 private:
  struct Trace {
    StationState state = StationState::kOff;
    Reason reason = Reason::kStart;
    Motion<1> local, remote, target;
    double effort = 0.0;
    Nanoseconds playout_depth = 0, rtt = 0;
    std::uint32_t limits = 0;
  };

  Motion<1> own_motion() const noexcept { return {trace_.local.x, trace_.local.v, -trace_.local.f}; }

  [[gnu::noinline]] void decide(Nanoseconds now, bool valid, bool finite, OperatorAct act, bool peer_known) noexcept {
    const double offset = (trace_.local.x - trace_.remote.x).abs().maxCoeff();
    EngagementInputs in;
    in.act = act;
    in.device_valid = valid;
    in.finite = !valid || finite;
    const GateParams& gate = p_.drive.gate;
    const double room = 0.5 * (gate.range_max - gate.range_min);
    in.in_range = trace_.local.x[0] >= gate.range_min - room && trace_.local.x[0] <= gate.range_max + room;
    in.at_rest = drive_.at_rest();
    in.peer_alive = !receiver_.take_lapse() && peer_known && receiver_.alive(now);
    in.peer = receiver_.newest().state;
    in.aligned = peer_known && receiver_.settled(now) && blend_.done() &&
                 offset < (p_.role == Role::kLeader ? p_.align_tolerance : 0.0873);
    const StationState before = trace_.state;
    trace_.state = engagement_.step(now, in);
    trace_.reason = engagement_.reason();
    changed_ = trace_.state != before;
    if (changed_) x_hold_ = trace_.local.x;
  }
  Motion<1> choose() const noexcept {
    switch (trace_.state) {
      case StationState::kEngaged:
        return trace_.remote;
      case StationState::kAligning:
        return {trace_.remote.x, trace_.remote.v, -trace_.local.f};
      case StationState::kHolding:
        return {x_hold_, Joints<1>::Zero(), Joints<1>::Zero()};
      default:
        return own_motion();
    }
  }
  bool leapt(const Motion<1>& source, int ticks) const noexcept {
    return trace_.state == StationState::kAligning &&
           ((source.x - x_source_).abs() > 1e-3 + 1.25 * p_.drive.dt_s * ticks * source.v.abs()).any();
  }
  void fill(Packet<1>& packet, Nanoseconds now) noexcept {
    packet.session = p_.session;
    packet.seq = ++seq_;
    packet.send_time_ns = now;
    receiver_.echo(packet, now);
    packet.expiry_ms = p_.expiry_ms;
    packet.state = trace_.state;
    packet.limits = trace_.limits;
    packet.motion = trace_.local;
  }

  Params p_;
  Drive drive_;
  Receiver<1> receiver_;
  Engagement engagement_;
  Blend<1> blend_;
  Trace trace_;
  Joints<1> x_hold_ = Joints<1>::Zero(), x_source_ = Joints<1>::Zero();
  std::uint32_t seq_ = 0;
  bool was_usable_ = false, changed_ = false;
};

}  // namespace farhand::cut
