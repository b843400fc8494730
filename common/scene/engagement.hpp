// When may the two sides move each other? One small state machine, the same table on both sides.
//
//   Ready     nothing is driven.                        Aligning  the therapist's device is led to the patient's angle.
//   Engaged   the law has the axis.                     Holding   stays softly where it is: the peer is silent, or
//   asked to hold. Fault     nothing is driven, until reset.
//
// The leader (therapist) engages by an operator's act. The follower (patient) engages only on the *edge* of a leader
// that it has seen disengaged since it last let go, so that no stale or resumed stream of "engaged" packets can take
// the hand.
#pragma once

#include "common/link/packet.hpp"

namespace farhand {

enum class Role : std::uint8_t { kLeader, kFollower };

enum class OperatorAct : std::uint8_t { kNone, kEngage, kHold, kStop, kReset };

// Why the state last changed; in events and on the status line.
enum class Reason : std::uint8_t {
  kStart,
  kOperator,
  kPeerSilent,
  kPeerFault,
  kPeerLetGo,
  kPeerEngaged,
  kAligned,
  kTimeout,
  kDeviceLost,
  kNotFinite
};

constexpr const char* name_of(StationState state) noexcept {
  constexpr const char* kNames[] = {"ready", "aligning", "engaged", "holding", "fault"};
  return kNames[static_cast<int>(state)];
}
constexpr const char* name_of(OperatorAct act) noexcept {
  constexpr const char* kNames[] = {"nothing", "engage", "hold", "stop", "reset"};
  return kNames[static_cast<int>(act)];
}
constexpr const char* name_of(Reason reason) noexcept {
  constexpr const char* kNames[] = {
      "start",        "operator", "peer silent", "peer in fault", "peer let go",
      "peer engaged", "aligned",  "timeout",     "device lost",   "reading is not a number"};
  return kNames[static_cast<int>(reason)];
}

struct EngagementParams {
  Nanoseconds timeout = 5 * kSecond;  // gives up aligning, or waiting for the follower to engage
};

struct EngagementInputs {
  OperatorAct act = OperatorAct::kNone;
  bool device_valid = true;  // own device can be read and obeys
  bool finite = true;        // its readings are numbers
  bool peer_alive = false;
  StationState peer = StationState::kReady;
  bool aligned = false;  // close enough to the peer to engage
};

class Engagement {
 public:
  Engagement(Role role, const EngagementParams& params) : role_(role), params_(params) {}

  StationState step(Nanoseconds now, const EngagementInputs& in) noexcept {
    if (in.peer_alive && in.peer != StationState::kEngaged) peer_seen_disengaged_ = true;
    if (in.peer_alive && in.peer == StationState::kEngaged) peer_seen_engaged_ = true;
    const auto [next, reason] = decide(now, in);
    if (next != state_) {
      state_ = next;
      reason_ = reason;
      since_ = now;
      peer_seen_disengaged_ = false;
      peer_seen_engaged_ = false;
    }
    return state_;
  }

  StationState state() const noexcept { return state_; }
  Reason reason() const noexcept { return reason_; }

 private:
  struct Decision {
    StationState next;
    Reason reason;
  };

  Decision decide(Nanoseconds now, const EngagementInputs& in) const noexcept {
    using S = StationState;
    if (state_ == S::kFault) return in.act == OperatorAct::kReset ? Decision{S::kReady, Reason::kOperator} : stay();
    if (!in.finite) return {S::kFault, Reason::kNotFinite};
    if (!in.device_valid) return {S::kReady, Reason::kDeviceLost};
    if (in.act == OperatorAct::kStop) return {S::kReady, Reason::kOperator};
    if (state_ == S::kReady || state_ == S::kHolding) return from_rest(in);
    if (in.act == OperatorAct::kHold) return {S::kHolding, Reason::kOperator};
    if (!in.peer_alive) return {S::kHolding, Reason::kPeerSilent};
    if (in.peer == S::kFault) return {S::kHolding, Reason::kPeerFault};
    if (state_ == S::kAligning) {
      if (in.aligned) return {S::kEngaged, Reason::kAligned};
      return now - since_ > params_.timeout ? Decision{S::kHolding, Reason::kTimeout} : stay();
    }
    if (role_ == Role::kFollower) {
      if (in.peer == S::kEngaged) return stay();
      // A therapist who stops lets the hand go; one who holds keeps it where it is.
      return {in.peer == S::kReady ? S::kReady : S::kHolding, Reason::kPeerLetGo};
    }
    // The follower hears of the engagement one delay later and answers one more later.
    if (peer_seen_engaged_) return in.peer == S::kEngaged ? stay() : Decision{S::kHolding, Reason::kPeerLetGo};
    return now - since_ > params_.timeout ? Decision{S::kHolding, Reason::kTimeout} : stay();
  }

  Decision from_rest(const EngagementInputs& in) const noexcept {
    using S = StationState;
    if (!in.peer_alive) return stay();
    if (role_ == Role::kLeader) {
      const bool asked = in.act == OperatorAct::kEngage && (in.peer == S::kReady || in.peer == S::kHolding);
      return asked ? Decision{S::kAligning, Reason::kOperator} : stay();
    }
    const bool edge = in.peer == S::kEngaged && peer_seen_disengaged_ && in.aligned;
    return edge ? Decision{S::kEngaged, Reason::kPeerEngaged} : stay();
  }

  Decision stay() const noexcept { return {state_, reason_}; }

  Role role_;
  EngagementParams params_;
  StationState state_ = StationState::kReady;
  Reason reason_ = Reason::kStart;
  Nanoseconds since_ = 0;
  bool peer_seen_disengaged_ = false;
  bool peer_seen_engaged_ = false;
};

}  // namespace farhand
