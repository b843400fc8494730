// One side of the teleoperator, pure: a law on a drive, the receiver of the peer's motion and the state machine. Time,
// readings and packets are arguments; the command and the next packet are results. The same class runs in the programs
// and in virtual time.
//
// Order within a tick: read -> observe -> play out the peer -> intake gate -> guard -> decide the state -> law ->
// motion to follow -> bound at the person -> last gate -> send.
#pragma once

#include <algorithm>

#include "common/law/law.hpp"
#include "common/link/receiver.hpp"
#include "common/station/after_gap.hpp"
#include "common/station/blend.hpp"
#include "common/station/drive.hpp"
#include "common/station/engagement.hpp"
#include "common/station/gap_watch.hpp"
#include "common/station/intake.hpp"
#include "common/station/last_word.hpp"
#include "common/station/led_motion.hpp"
#include "common/station/missed_ticks.hpp"
#include "common/station/network_meter.hpp"
#include "common/station/patient_guard.hpp"
#include "common/station/previous_sample.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

// Io: DirectIo or ReferenceIo, which fixes the number of joints.
template <class Io>
class Station {
 public:
  static constexpr int N = Io::kJoints;
  using Drive = DriveOn<Io>;
  using Sensed = typename Io::Sensed;

  struct Output {
    typename Io::Command command;
    Packet<N> packet;
  };

  // law, and identifying where the scene asks for it and the device takes a torque: both outlive the station.
  Station(const StationParams& p, Law<N>& law, Identifying* identifying = nullptr)
      : params_(p),
        dt_s_(p.control.drive.dt_s),
        law_(law),
        drive_(p.control.drive),
        receiver_(p.receive, p.session),
        intake_(p.intake, p.control.drive.dt_s),
        engagement_(p.role, where_it_can(p.engagement, identifying)),
        gap_watch_(p.session),
        led_(p, identifying),
        after_gap_(p.control.drive.dt_s),
        own_ticks_(p.control.drive.dt_s),
        peer_ticks_(p.control.drive.dt_s),
        last_word_(p.control.drive.dt_s, p.intake.wave > 0.0),
        blend_(p.blend_s, p.align_speed),
        meter_(p.control.drive.dt_s) {
    trace_.friction = p.friction;
    if (p.role == Role::kFollower) {
      guard_.emplace(p.guard, p.control.drive);
    } else {
      watch_.emplace(p.guard);
    }
  }

  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  // A packet arrived at `now` (local monotonic clock).
  Receipt receive(const Packet<N>& packet, Nanoseconds now) noexcept { return receiver_.accept(packet, now); }

  // ticks: control periods since the last call, 1 unless some were missed.
  Output tick(Nanoseconds now, const Sensed& read, OperatorAct act = OperatorAct::kNone, int ticks = 1) noexcept;

  // What an earlier sweep has found; before the first tick.
  void know(const KnownFriction& friction) noexcept { trace_.friction = friction; }

  const TickTrace<N>& trace() const noexcept { return trace_; }
  const Receiver<N>& receiver() const noexcept { return receiver_; }
  StationState state() const noexcept { return trace_.state; }

 private:
  static constexpr double kLeap = 0.75e-3;  // rad
  static constexpr double kSpared = 1.0;    // s
  static constexpr double kStiff = 0.35;    // s
  static constexpr int kAfterGap = 20;      // ticks; compensation reacts a few ticks after the packets catch up

  static EngagementParams where_it_can(EngagementParams params, const Identifying* by) noexcept {
    params.identification = params.identification && Drive::kGivesTorque && by != nullptr;
    return params;
  }

  // A reading further outside the range of motion than half its width cannot come from this device.
  bool in_range() const noexcept {
    const GateParams& gate = params_.control.drive.gate;
    const double room = 0.5 * (gate.range_max - gate.range_min);
    return (trace_.local.x >= gate.range_min - room && trace_.local.x <= gate.range_max + room).all();
  }

  // For laws that choose by the network; unknown while a gap in time still counts.
  void measure_network(int ticks) noexcept {
    meter_.step(receiver_.counters(), ticks, after_gap_.settled());
    network_ = {.round_trip = to_seconds(trace_.rtt + 2 * trace_.playout_depth), .loss = meter_.loss()};
    inputs_.network = after_gap_.settled() && receiver_.rtt() ? &network_ : nullptr;
  }

  // Energy that went through the port since the last tick, for laws that keep account of it.
  void keep_account(const Joints<N>& moved, int ticks) noexcept {
    const double told = receiver_.newest().energy * params_.scale.force / params_.scale.position;
    inputs_.account = {.torque = drive_.acting(trace_.local),
                       .acted = drive_.acted_share(),
                       .moved = moved,
                       .received = receiver_.heard() ? intake_.energy(told, driven(), ticks) : 0.0,
                       .engaged = trace_.state == StationState::kEngaged};
  }

  // Steps the law; called after the state is decided.
  void ask_law(Elapsed since) noexcept {
    inputs_.local = trace_.local;
    inputs_.received = trace_.remote;
    inputs_.since = since;
    inputs_.engaged = trace_.state == StationState::kEngaged;
    if (receiver_.heard()) {
      inputs_.peer_friction = intake_.friction(receiver_.newest().friction * params_.scale.force);
      inputs_.peer_friction_known = receiver_.newest().friction_known;
    }
    if (changed_ && inputs_.engaged) law_.start(inputs_);
    wish_ = law_.step(inputs_);
    trace_.law = law_.signals();
  }

  // Reduces the motion to follow after a gap in time. The patient's hand is damped meanwhile, the therapist is not.
  Motion<N> after_gap(const Motion<N>& target) const noexcept {
    const double g = after_gap_.share();
    if (g == 1.0) return target;
    Motion<N> less = yielding(trace_.local, target, g);
    if (!guard_) less.v += (1.0 - g) * trace_.local.v;
    return less;
  }

  bool driven() const noexcept { return asks_of(trace_.state) == Asks::kMotion; }

  // The axis' own motion: to follow it needs no acceleration.
  Motion<N> own_motion() const noexcept { return {trace_.local.x, trace_.local.v, -trace_.local.f}; }

  // continues: this reading has the same zero as the last one.
  void guard(const Sensed& sensed, bool continues, OperatorAct act, int ticks) noexcept {
    const GuardInputs<N> in{.local = drive_.for_guards(trace_.local),
                            .reference = followed_,
                            .torque = drive_.torque(),
                            .gives_torque = Drive::kGivesTorque,
                            .device = sensed.device,
                            .driven = driven(),
                            .engaged = trace_.state == StationState::kEngaged,
                            .valid = was_usable_,
                            .periods = sensed.periods,
                            .continues = continues && engagement_.knows_angle(),
                            .ticks = ticks};
    if (guard_) {
      if (act == OperatorAct::kReset) guard_->reset();
      verdict_ = guard_->step(in);
    } else {
      verdict_ = {};
      watch_->step(in, verdict_);
      const double spared = drive_.spared() != 0 ? 1.0 : 0.0;
      spared_ = in.engaged ? spared_ + std::min(1.0, dt_s_ * ticks / kSpared) * (spared - spared_) : 0.0;
      verdict_.hold = spared_ > 0.5;
    }
  }

  void decide(Nanoseconds now, const Sensed& sensed, OperatorAct act, bool peer_known, bool slept) noexcept {
    const double offset = (trace_.local.x - trace_.remote.x).abs().maxCoeff();
    EngagementInputs in;
    in.act = act;
    in.guard_fault = verdict_.fault;
    in.limit_holds = verdict_.hold;
    in.shaken = verdict_.shaken;
    in.device_valid = sensed.valid;
    in.finite = !sensed.valid || sensed.finite();
    in.in_range = params_.engagement.homing || in_range();
    in.at_rest = drive_.at_rest(sensed);
    if constexpr (requires { sensed.line; }) in.line = sensed.line;
    led_.report(in);
    in.peer_alive = !receiver_.take_lapse() && peer_known && receiver_.alive(now);
    in.peer = receiver_.newest().state;
    in.gap = gap_watch_.inputs(now, receiver_, trace_.local, trace_.remote, peer_known, slept);
    in.aligned = peer_known && (receiver_.settled(now) || engagement_.gap().resumes()) && blend_.done() &&
                 offset < near_enough();
    const StationState before = trace_.state;
    trace_.state = engagement_.step(now, in);
    trace_.reason = engagement_.reason();
    trace_.waits = engagement_.gap().waits();
    trace_.resumes = engagement_.gap().resumes();
    trace_.resumed = engagement_.gap().count_of_minute(now);
    changed_ = trace_.state != before;
    if (!changed_) return;
    x_hold_ = trace_.local.x;
    if (trace_.waits) gap_watch_.begin(now, trace_.reason, receiver_);
    if (LedMotion::leads(before)) end_led(before);
    if (LedMotion::leads(trace_.state)) drive_.limit(led_.begin(trace_.state, trace_.local.x[0], params_));
  }

  void end_led(StationState led) noexcept {
    drive_.limit(params_.control.drive.gate);
    if (led == StationState::kIdentifying)
      trace_.misfit = trace_.reason == Reason::kAnotherAxis ? led_.misfit() : Misfit::kNone;
    if (led == StationState::kSweeping) trace_.swept = led_.swept();
    if (trace_.reason == Reason::kSwept) trace_.friction = {.threshold = trace_.swept.F_c, .known = true};
    if (trace_.reason != Reason::kHomed) return;
    zero_ += led_.homing().zero();
    trace_.local.x += led_.homing().zero();
    trace_.target.x += led_.homing().zero();
    was_usable_ = false;  // the next reading is differentiated from itself
  }

  // The motion to follow, before blending.
  Motion<N> choose(int ticks) noexcept {
    switch (trace_.state) {
      case StationState::kEngaged:
        return wish_.follow;
      case StationState::kAligning:  // stiff: the position alone counts
        return {trace_.remote.x, trace_.remote.v, -stiff(ticks) * trace_.local.f};
      case StationState::kHolding:  // a spring of K_p / K_f N m/rad, which a person can push away
        return {x_hold_, Joints<N>::Zero(), Joints<N>::Zero()};
      case StationState::kHoming:
      case StationState::kIdentifying:
      case StationState::kSweeping:
        return led_.step(trace_.state, trace_.local, ticks);
      case StationState::kOff:
      case StationState::kSelfTest:
      case StationState::kReady:
      case StationState::kFault:
      case StationState::kStopped:
        break;
    }
    return own_motion();
  }

  // Who goes on after a gap of the network may not know of it, and push on. His device is then led by the soft spring
  // of Holding, which gives way, and engages within 5 degrees. Waves are the exception: their law has no angle of the
  // peer, an offset would stay. There the device must come as near as ever, and becomes stiff within kStiff.
  bool soft() const noexcept { return trace_.resumes && params_.intake.wave == 0.0; }
  double stiff(int ticks) noexcept {
    if (!trace_.resumes) return 1.0;
    aligning_s_ = changed_ ? 0.0 : aligning_s_ + dt_s_ * ticks;
    const double s = std::min(1.0, aligning_s_ / kStiff);
    return soft() ? 0.0 : s * s * (3.0 - 2.0 * s);
  }
  double near_enough() const noexcept {
    return params_.role == Role::kFollower || soft() ? kEngagedApart : params_.align_tolerance;
  }

  // While the leader aligns, the peer's device may come back at another angle (its cable was unplugged), and the motion
  // shown of it may jump in time. The same can happen after a gap of the network while the engagement still fades in. A
  // step that the peer's velocity does not explain is faded in like any other change of source. (The follower has its
  // guard instead. Without a gap a step is only a count of a coarse encoder, and fades for all of these would never
  // end.)
  bool leapt(const Motion<N>& source, int ticks) const noexcept {
    const bool engaging = trace_.state == StationState::kAligning ||
                          (gap_ > 0 && trace_.state == StationState::kEngaged && !guard_ && !blend_.done());
    const Joints<N> dx = source.x - x_source_;
    const bool far = (dx.abs() > kLeap + 1.25 * dt_s_ * ticks * source.v.abs()).any();
    const bool against = (dx * source.v < 0.0 && dx.abs() > kLeap).any();
    return engaging && (far || against);
  }

  void fill(Packet<N>& packet, Nanoseconds now) noexcept {
    packet.session = params_.session;
    packet.seq = ++seq_;
    packet.send_time_ns = now;
    receiver_.echo(packet, now);
    packet.expiry_ms = params_.expiry_ms;
    packet.state = trace_.state;
    packet.limits = trace_.limits | engagement_.told_of_gap();
    packet.motion = params_.scale.to_peer(Motion<N>{wish_.tell.x, wish_.tell.v, wish_.tell.u});
    if (params_.role == Role::kFollower) {
      packet.friction = trace_.friction.threshold;
      packet.friction_known = trace_.friction.known;
    }
    if (law_.needs().account) packet.energy = wish_.energy * params_.scale.position / params_.scale.force;
    if (law_.needs().previous) previous_.tell(packet, now);
  }

  StationParams params_;
  double dt_s_;
  Law<N>& law_;
  Drive drive_;
  Receiver<N> receiver_;
  Intake<N> intake_;
  Engagement engagement_;
  GapWatch<N> gap_watch_;
  LedMotion led_;
  AfterGap after_gap_;
  OwnTicks own_ticks_;
  PeerTicks peer_ticks_;
  LastWord<N> last_word_;
  Nanoseconds shown_ = 0;  // content time, on the peer's clock
  Blend<N> blend_;
  NetworkMeter meter_;  // used only if the law needs it
  NetworkNow network_;
  LawInputs<N> inputs_;
  Wish<N> wish_;
  std::optional<PatientGuard<N>> guard_;  // the follower's only
  std::optional<AxisWatch<N>> watch_;     // the leader's; the guard has its own
  GuardVerdict verdict_;
  Motion<N> followed_;
  TickTrace<N> trace_;
  Joints<N> x_hold_ = Joints<N>::Zero();
  Joints<N> x_source_ = Joints<N>::Zero();
  double zero_ = 0.0;  // rad, found by homing
  std::uint32_t seq_ = 0;
  PreviousSample<N> previous_;  // used only if the law needs it
  bool was_usable_ = false;
  int gap_ = 0;  // ticks in which a gap of the network still counts
  bool changed_ = false;
  double aligning_s_ = 0.0;  // after a gap of the network
  double spared_ = 0.0;  // the leader's only: recent share of the ticks in which he was protected by the person bound
};

template <class Io>
auto Station<Io>::tick(Nanoseconds now, const Sensed& read, OperatorAct act, int ticks) noexcept -> Output {
  // Read: move the reading to the zero that homing found.
  std::optional<Sensed> homed;
  if (zero_ != 0.0) (homed = read)->x += zero_;
  const Sensed& sensed = homed ? *homed : read;
  const bool usable = sensed.valid && sensed.finite();
  const int gap = own_ticks_.since_last(now, ticks);

  // Observe: estimate velocity and torque of the own axis, from a fresh start after readings that could not be used.
  Motion<N>& local = trace_.local;
  const Joints<N> x_before = local.x;
  if (usable) {
    if (!was_usable_) drive_.reset(sensed);
    local = drive_.observe(sensed, gap);
  }
  const bool continues = usable && was_usable_;
  was_usable_ = usable;

  // Play out the peer, through the first gate. Without a peer the own motion stands in its place.
  const Played<N> played = receiver_.play(now);
  if (played.any) {
    trace_.remote = intake_.step(params_.scale.to_own(played.motion), played.held, driven(), ticks);
  } else {
    intake_.reset();
    last_word_.reset();
    trace_.remote = own_motion();
  }

  // Gaps in time: how much of the peer's motion may be followed, and repetition without its noise.
  const double peers_gap_s = peer_ticks_.missed_s(receiver_.newest());
  after_gap_.step(played.any && played.held && played.content_time == shown_, gap, peers_gap_s,
                  trace_.state == StationState::kEngaged, drive_.acted_share());
  shown_ = played.content_time;
  if (played.any) trace_.remote = last_word_.step(trace_.remote, after_gap_.silent_s());
  trace_.cuts = intake_.cuts();
  trace_.playout_depth = played.depth;
  trace_.rtt = receiver_.rtt().value_or(0);

  // Guard, state machine and law, in this order: the law must know whether it is engaged.
  if (law_.needs().account) keep_account(continues ? Joints<N>(local.x - x_before) : Joints<N>::Zero(), ticks);
  if (law_.needs().network) measure_network(ticks);
  guard(sensed, continues, act, ticks);
  gap_watch_.step(now, local.x);
  const bool slept = gap > kLongestGap || dt_s_ * gap > kSlept || peers_gap_s > kSlept || peer_ticks_.set_back();
  decide(now, sensed, act, played.any, slept);
  ask_law({.ticks = ticks,
           .held = played.held,
           .rested = after_gap_.rested(),
           .settled = after_gap_.settled(),
           .calm = after_gap_.calm(),
           .silent_s = after_gap_.silent_s(),
           .acting = after_gap_.acting(),
           .peers_acting = after_gap_.peers_acting()});

  // The motion to follow: a change of its source is faded, so that nothing jumps.
  const Motion<N> source = choose(ticks);
  const Asks asks = asks_of(trace_.state);
  if (asks == Asks::kNothing) {
    trace_.target = source;
  } else {
    const bool elsewhere = changed_ || leapt(source, ticks);
    if (elsewhere && trace_.state == StationState::kHolding) {
      blend_.begin_rest(trace_.target, source);
    } else if (elsewhere && trace_.state == StationState::kAligning && trace_.resumes) {
      blend_.begin_near(trace_.target, source);
    } else if (changed_ && trace_.state == StationState::kEngaged && trace_.resumes) {
      blend_.begin_gently(trace_.target, source);
    } else if (elsewhere) {
      blend_.begin(trace_.target, source);
    }
    trace_.target = blend_.step(source, elsewhere ? 0.0 : dt_s_ * ticks);
  }
  x_source_ = source.x;
  gap_ = played.held ? kAfterGap : std::max(gap_ - ticks, 0);
  trace_.share = after_gap_.share();

  // A motion by which the station itself leads the axis has its own gate and does not depend on the peer.
  if (LedMotion::leads(trace_.state)) {
    followed_ = trace_.target;
  } else if (guard_) {
    followed_ = guard_->allow(local, after_gap(trace_.target), verdict_.gain);
  } else {
    followed_ = yielding(local, after_gap(trace_.target), verdict_.gain);
  }

  // Drive and last gate: zero torque at once without a usable reading, or in a state that asks for nothing.
  const Wanted wanted{.driven = asks == Asks::kMotion, .as_torque = inputs_.engaged && wish_.as_torque};
  Output out;
  out.command = usable && asks != Asks::kNothing ? drive_.follow(local, followed_, wanted, ticks) : drive_.safe();
  if constexpr (requires { out.command.reference; }) out.command.reference.x -= zero_;
  if (trace_.state == StationState::kIdentifying) led_.sample(local.x[0], drive_.torque()[0], ticks);

  // Report the limits that acted, and fill the packet for the peer.
  trace_.limits = drive_.active_limits() | (sensed.finite() ? 0u : kLimitNotFinite);
  // Values of the peer that were cut, and torque that was reduced at the person, are reported as a limit and a warning.
  const std::uint32_t cut = played.any ? intake_.active() | drive_.spared() : drive_.spared();
  trace_.limits |= cut | cut << kWarningShift | verdict_.limits | verdict_.warnings << kWarningShift;
  trace_.shaking = verdict_.shaking;
  trace_.effort = drive_.torque()[0];
  fill(out.packet, now);
  return out;
}

// Compiled once, in station.cpp, so that an edit of a law rebuilds little.
extern template class Station<DirectIo<1>>;
extern template class Station<ReferenceIo<1>>;

}  // namespace farhand
