#include "common/station/engagement.hpp"

namespace farhand {
namespace {

using enum StationState;
using enum Transition::Whose;
using S = Circumstances;

bool act(const S& s, OperatorAct one) noexcept { return s.in.act == one; }
bool peer(const S& s, StateSet states) noexcept { return s.in.peer_alive && states.has(s.in.peer); }
// The peer says so of a gap of the network.
bool gap(const S& s, GapBit bit) noexcept { return (s.in.gap.told & bit) != 0; }
bool tested(const S& s) noexcept { return s.sound >= s.params.self_test && s.in.line == LineQuality::kGood; }
bool knows_angle(const S& s) noexcept { return s.homed || !s.params.homing; }

// The leader (therapist) engages by an operator's act. The follower (patient) engages only on the *edge* of a leader
// that it has seen disengaged since it last let go, so that no stale or resumed stream of "engaged" packets can take
// the hand. Out of Fault and Stopped leads an act of this very side, nothing that a packet says.
//
// A short gap of the network is the exception: both sides go on by themselves (resumption.hpp). The leader aligns as
// soon as the follower says that it holds for the gap alone, and engages once the follower hears it. The follower does
// not take this for an operator's engagement, because the leader says that it is none.
//
// The order is the priority: what ends a motion stands above what begins one.
// clang-format off
constexpr Transition kTransitions[] = {
    // Latches, and what leads there.
    {StateSet::all_but({kFault}), kFault, Reason::kNotFinite, kEither, "a reading is not a number",
     [](const S& s) noexcept { return !s.in.finite; }},
    {StateSet::all_but({kFault}), kFault, Reason::kNone, kEither, "the guard of this side finds a fault",
     [](const S& s) noexcept { return s.in.guard_fault.has_value(); }},
    {{kFault, kStopped}, kSelfTest, Reason::kOperator, kEither, "`reset` on this side",
     [](const S& s) noexcept { return act(s, OperatorAct::kReset); }},
    {StateSet::all_but({kFault, kStopped}), kStopped, Reason::kOperator, kEither, "`stop` on this side",
     [](const S& s) noexcept { return act(s, OperatorAct::kStop); }},

    // The device.
    {{kHoming, kIdentifying, kSweeping}, kFault, Reason::kDeviceLost, kEither, "the device is lost",
     [](const S& s) noexcept { return !s.in.device_valid; }},
    {StateSet::all_but({kOff, kHoming, kIdentifying, kSweeping, kFault, kStopped}), kOff, Reason::kLineLags, kEither,
     "commands and their echoes take 20 ms longer than the line needs",
     [](const S& s) noexcept { return s.in.line == LineQuality::kLags; }},
    {StateSet::all_but({kOff, kHoming, kIdentifying, kSweeping, kFault, kStopped}), kOff, Reason::kDeviceLost, kEither, "the device is lost",
     [](const S& s) noexcept { return !s.in.device_valid; }},
    {{kOff}, kSelfTest, Reason::kDeviceFound, kEither, "the device answers",
     [](const S& s) noexcept { return s.in.device_valid; }},
    {{kSelfTest}, kReady, Reason::kTested, kEither, "20 ms without a finding, and the angle is known",
     [](const S& s) noexcept { return tested(s) && knows_angle(s); }},
    {{kSelfTest}, kHoming, Reason::kOperator, kEither, "20 ms without a finding, the scene asks for homing, `home` on this side",
     [](const S& s) noexcept { return tested(s) && !knows_angle(s) && act(s, OperatorAct::kHome); }},
    {{kSelfTest}, kFault, Reason::kOutOfRange, kEither, "not sound within 1 s: a reading is out of range",
     [](const S& s) noexcept { return !tested(s) && s.here > s.params.self_test_limit && !s.in.in_range; }},
    {{kSelfTest}, kFault, Reason::kLineSlow, kEither,
     "not sound within 1 s: the line to the device takes more than 8 ms, or its MCU does not tell",
     [](const S& s) noexcept { return !tested(s) && s.here > s.params.self_test_limit && s.in.line != LineQuality::kGood; }},
    {{kSelfTest}, kFault, Reason::kNotAtRest, kEither, "not sound within 1 s: the device gives torque",
     [](const S& s) noexcept { return !tested(s) && s.here > s.params.self_test_limit; }},
    {{kHoming, kIdentifying, kSweeping}, kFault, Reason::kOperator, kEither, "any act on this side but `stop`",
     [](const S& s) noexcept { return !act(s, OperatorAct::kNone); }},
    {{kHoming}, kFault, Reason::kBlocked, kEither, "a stop where none is, on the way back",
     [](const S& s) noexcept { return s.in.homing == HomingProgress::kBlocked; }},
    {{kHoming}, kReady, Reason::kHomed, kEither, "the stop was found, and the axis is back",
     [](const S& s) noexcept { return s.in.homing == HomingProgress::kDone; }},
    {{kHoming}, kFault, Reason::kTimeout, kEither, "not done in time",
     [](const S& s) noexcept { return s.here > s.params.homing_timeout; }},

    {{kIdentifying}, kFault, Reason::kBlocked, kEither, "something is in the way",
     [](const S& s) noexcept { return s.in.identifying == IdentifyingProgress::kBlocked; }},
    {{kIdentifying}, kFault, Reason::kAnotherAxis, kEither, "the axis is not the one of the scene, or not free",
     [](const S& s) noexcept { return s.in.identifying == IdentifyingProgress::kAnother; }},
    {{kIdentifying}, kReady, Reason::kIdentified, kEither, "the axis is the one of the scene, and is back",
     [](const S& s) noexcept { return s.in.identifying == IdentifyingProgress::kAsSaid; }},

    {{kSweeping}, kFault, Reason::kBlocked, kFollower, "something is in the way",
     [](const S& s) noexcept { return s.in.sweeping == SweepingProgress::kBlocked; }},
    {{kSweeping}, kFault, Reason::kResisted, kFollower, "the reaction is over 0.4 N m, or its slope over 0.2 N m/rad",
     [](const S& s) noexcept { return s.in.sweeping == SweepingProgress::kResisted; }},
    {{kSweeping}, kFault, Reason::kUneven, kFollower, "the friction scatters over the angle by more than a quarter and 0.02 N m",
     [](const S& s) noexcept { return s.in.sweeping == SweepingProgress::kUneven; }},
    {{kSweeping}, kReady, Reason::kSwept, kFollower, "the friction is measured, and the axis is back",
     [](const S& s) noexcept { return s.in.sweeping == SweepingProgress::kDone; }},

    // The two together: out of a common motion,
    {{kAligning, kEngaged}, kHolding, Reason::kOperator, kEither, "`hold` on this side",
     [](const S& s) noexcept { return act(s, OperatorAct::kHold); }},
    {{kEngaged}, kHolding, Reason::kPatientLimit, kFollower, "a limit of the patient's side asks for rest",
     [](const S& s) noexcept { return s.in.limit_holds; }},
    {{kEngaged}, kHolding, Reason::kTherapistLimit, kLeader, "for most of a second the therapist is moved at his limits",
     [](const S& s) noexcept { return s.in.limit_holds; }},
    {{kEngaged}, kHolding, Reason::kShaken, kEither, "the hand is shaken, and less of the peer's wishes does not calm it",
     [](const S& s) noexcept { return s.in.shaken; }},
    {{kAligning, kEngaged}, kHolding, Reason::kPeerSilent, kEither, "nothing heard for `receive.timeout_s`",
     [](const S& s) noexcept { return !s.in.peer_alive; }},
    {{kAligning, kEngaged}, kHolding, Reason::kPeerFault, kEither, "the peer is in Fault",
     [](const S& s) noexcept { return peer(s, {kFault}); }},
    {{kAligning, kEngaged}, kHolding, Reason::kPeerStopped, kLeader, "the peer is Stopped",
     [](const S& s) noexcept { return peer(s, {kStopped}); }},
    {{kEngaged}, kReady, Reason::kPeerStopped, kFollower, "the peer is Stopped",
     [](const S& s) noexcept { return peer(s, {kStopped}); }},
    {{kEngaged}, kReady, Reason::kPeerLetGo, kFollower, "the peer is Off, in Self-test, Homing, Identifying, Sweeping or Ready",
     [](const S& s) noexcept { return peer(s, {kOff, kSelfTest, kHoming, kIdentifying, kSweeping, kReady}); }},
    {{kEngaged}, kHolding, Reason::kPeerDeaf, kFollower, "the peer is Holding or Aligning, because it heard nothing",
     [](const S& s) noexcept { return peer(s, {kHolding, kAligning}) && gap(s, kGapHeld); }},
    {{kEngaged}, kHolding, Reason::kPeerLetGo, kFollower, "the peer is Holding or Aligning",
     [](const S& s) noexcept { return peer(s, {kHolding, kAligning}); }},
    {{kEngaged}, kHolding, Reason::kPeerDeaf, kLeader, "the peer was Engaged and is Holding, because it heard nothing",
     [](const S& s) noexcept { return s.peer_seen_engaged && peer(s, {kHolding}) && gap(s, kGapHeld); }},
    {{kAligning, kEngaged}, kHolding, Reason::kPeerDeaf, kLeader, "this is a resumption, and the peer takes no part any more, or has not heard this side for too long",
     [](const S& s) noexcept { return s.gap.resumes() && s.in.peer_alive &&
                                        (s.in.gap.without > s.params.longest_gap ||
                                         !(peer(s, {kEngaged}) || (peer(s, {kHolding}) && gap(s, kGapHeld)))); }},
    {{kEngaged}, kHolding, Reason::kPeerLetGo, kLeader, "the peer was Engaged and no longer is",
     [](const S& s) noexcept { return s.peer_seen_engaged && !peer(s, {kEngaged}); }},
    // and into one. The follower hears of the engagement one delay later and answers one more later.
    {{kAligning}, kEngaged, Reason::kAligned, kLeader,
     "within `engagement.align_tolerance_rad`, nothing fades any more; in a resumption the peer hears this side",
     [](const S& s) noexcept { return s.in.aligned && (!s.gap.resumes() || (peer(s, {kHolding}) && gap(s, kGapOver))); }},
    {{kAligning}, kHolding, Reason::kTimeout, kLeader, "not so close within `engagement.timeout_s`",
     [](const S& s) noexcept { return s.here > s.params.timeout; }},
    {{kEngaged}, kHolding, Reason::kTimeout, kLeader, "the peer did not engage within `engagement.timeout_s`",
     [](const S& s) noexcept { return !s.peer_seen_engaged && s.here > s.params.timeout; }},
    {{kReady}, kIdentifying, Reason::kOperator, kEither, "the scene asks for identification, `identify` on this side",
     [](const S& s) noexcept { return s.params.identification && act(s, OperatorAct::kIdentify); }},
    {{kReady}, kSweeping, Reason::kOperator, kFollower, "`friction` on this side, which has the patient; K_p is above 0",
     [](const S& s) noexcept { return s.params.sweep && act(s, OperatorAct::kSweep); }},
    {{kReady, kHolding}, kAligning, Reason::kOperator, kLeader, "`engage` on this side, the peer is Ready or Holding",
     [](const S& s) noexcept { return act(s, OperatorAct::kEngage) && peer(s, {kReady, kHolding}); }},
    {{kReady, kHolding}, kEngaged, Reason::kPeerEngaged, kFollower,
     "the edge (above), no resumption, within 5 degrees, nothing fades any more, nobody here asks for rest, nothing shakes",
     [](const S& s) noexcept { return peer(s, {kEngaged}) && !gap(s, kGapOver) && s.peer_seen_disengaged &&
                                        s.in.aligned && !s.in.limit_holds && !s.in.shaken &&
                                        !act(s, OperatorAct::kHold); }},
    {{kHolding}, kAligning, Reason::kResumed, kLeader,
     "resumption (above), the peer is Holding for the same gap, or still Engaged",
     [](const S& s) noexcept { return s.gap.ready() && ((peer(s, {kHolding}) && gap(s, kGapHeld)) || peer(s, {kEngaged})); }},
    {{kHolding}, kEngaged, Reason::kResumed, kFollower, "resumption (above), the edge, the peer resumes too",
     [](const S& s) noexcept { return s.gap.ready() && peer(s, {kEngaged}) && gap(s, kGapOver) &&
                                        s.peer_seen_disengaged; }},
};
// clang-format on

constexpr bool is_of(Transition::Whose whose, Role role) noexcept {
  return whose == kEither || (whose == kLeader) == (role == Role::kLeader);
}

}  // namespace

std::span<const Transition> Engagement::transitions() noexcept { return kTransitions; }

StationState Engagement::step(Nanoseconds now, const EngagementInputs& in) noexcept {
  if (in.peer_alive) (in.peer == kEngaged ? peer_seen_engaged_ : peer_seen_disengaged_) = true;
  watch_gap(now, in);
  if (!in.device_valid) homed_ = false;  // it may have been turned by hand, or restarted
  if (!in.finite || !in.in_range || !in.at_rest) sound_since_ = now;
  const Circumstances circumstances{
      in, params_, now - since_, now - sound_since_, homed_, peer_seen_engaged_, peer_seen_disengaged_, gap_};
  taken_ = nullptr;
  for (const Transition& row : kTransitions) {
    if (!row.from.has(state_) || !is_of(row.whose, role_) || !row.applies(circumstances)) continue;
    take(row, now, in);
    break;
  }
  return state_;
}

void Engagement::watch_gap(Nanoseconds now, const EngagementInputs& in) noexcept {
  // A leader that resumes does so until the follower is engaged.
  if (gap_.resumes() && (role_ == Role::kFollower || (state_ == kEngaged && peer_seen_engaged_))) gap_.end();
  if (!gap_.waits()) return;
  // The peer may not have noticed the gap yet, or holds for it too, or, as a leader, is on its way back.
  const StateSet with = role_ == Role::kLeader ? StateSet{kHolding} : StateSet{kHolding, kAligning};
  const bool knows = in.peer == kEngaged || (with.has(in.peer) && (in.gap.told & kGapHeld) != 0);
  const bool spoilt =
      in.act != OperatorAct::kNone || in.limit_holds || in.shaken || in.guard_fault || (in.peer_alive && !knows);
  gap_.hold(now, in.gap, spoilt, in.peer_alive);
}

std::uint32_t Engagement::told_of_gap() const noexcept {
  if (gap_.resumes() && role_ == Role::kLeader) return kGapHeld | kGapOver;
  const bool over = gap_.ready() && role_ == Role::kFollower;
  return (gap_.waits() ? kGapHeld : 0u) | (over ? kGapOver : 0u);
}

void Engagement::take(const Transition& row, Nanoseconds now, const EngagementInputs& in) noexcept {
  const bool both = state_ == kEngaged && (role_ == Role::kFollower || peer_seen_engaged_);
  const bool for_gap = row.reason == Reason::kPeerSilent || row.reason == Reason::kPeerDeaf;
  if (row.reason == Reason::kResumed) {
    gap_.take(now);
  } else if (both && for_gap) {
    gap_.begin(now, in.gap);
  } else if (row.reason != Reason::kAligned) {
    gap_.end();
  }
  taken_ = &row;
  state_ = row.to;
  reason_ = row.reason == Reason::kNone ? in.guard_fault.value_or(Reason::kNone) : row.reason;
  since_ = sound_since_ = now;
  peer_seen_disengaged_ = peer_seen_engaged_ = false;
  if (row.reason == Reason::kHomed) homed_ = true;
  if (state_ == kFault) homed_ = false;
}

}  // namespace farhand
