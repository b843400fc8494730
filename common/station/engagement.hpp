// Decides when the two sides may move each other. Both sides run the same state machine. It consists of the table of
// transitions in engagement.cpp: the first row that applies is taken, and there is no transition without a row.
#pragma once

#include <optional>
#include <span>

#include "common/station/drive_io.hpp"
#include "common/station/resumption.hpp"
#include "common/station/states.hpp"

namespace farhand {

struct EngagementParams {
  Nanoseconds timeout = 5 * kSecond;          // gives up aligning, or waiting for the follower to engage
  Nanoseconds self_test = 20 * kMillisecond;  // the self-test must find nothing for this long,
  Nanoseconds self_test_limit = kSecond;      // within this time
  bool homing = false;                        // the device knows its angle only after it was led to a stop
  Nanoseconds homing_timeout = 30 * kSecond;
  Nanoseconds longest_gap = 0;  // of the network, after which both sides go on without an act; 0: never
  bool identification = false;  // `identify` may check whether the axis is the one of the scene
  bool sweep = false;           // `friction` may measure the friction of the follower's device
};

enum class HomingProgress : std::uint8_t { kUnderway, kBlocked, kDone };
enum class IdentifyingProgress : std::uint8_t { kUnderway, kBlocked, kAnother, kAsSaid };
enum class SweepingProgress : std::uint8_t { kUnderway, kBlocked, kResisted, kUneven, kDone };

struct EngagementInputs {
  OperatorAct act = OperatorAct::kNone;   // of this side
  bool device_valid = true;               // own device can be read and obeys
  bool finite = true;                     // its readings are numbers,
  bool in_range = true;                   // and this device can reach them
  bool at_rest = true;                    // no torque is commanded, and the device says that it gives none
  LineQuality line = LineQuality::kGood;  // of the line to the device
  HomingProgress homing = HomingProgress::kUnderway;
  IdentifyingProgress identifying = IdentifyingProgress::kUnderway;
  SweepingProgress sweeping = SweepingProgress::kUnderway;
  std::optional<Reason> guard_fault;  // fault found by the guard of the patient's side
  bool limit_holds = false;           // a limit of the patient's side asks for rest
  bool shaken = false;                // the hand shakes although the gain of the peer's commands is low
  bool peer_alive = false;
  StationState peer = StationState::kReady;
  bool aligned = false;  // close enough to the peer to engage, and nothing still fades
  GapInputs gap = {};
};

// Inputs of a transition's condition.
struct Circumstances {
  const EngagementInputs& in;
  const EngagementParams& params;
  Nanoseconds here;                              // time in this state
  Nanoseconds sound;                             // length of the latest time in which the self-test found nothing
  bool homed;                                    // since the device was last found
  bool peer_seen_engaged, peer_seen_disengaged;  // in this state
  const Resumption& gap;
};

struct Transition {
  enum class Whose : std::uint8_t { kEither, kLeader, kFollower };
  StateSet from;
  StationState to;
  Reason reason;  // kNone: the guard's reason
  Whose whose;
  const char* when;
  bool (*applies)(const Circumstances&) noexcept;
};

class Engagement {
 public:
  Engagement(Role role, const EngagementParams& params) : role_(role), params_(params), gap_(params.longest_gap) {}

  StationState step(Nanoseconds now, const EngagementInputs& in) noexcept;

  StationState state() const noexcept { return state_; }
  Reason reason() const noexcept { return reason_; }
  bool knows_angle() const noexcept { return homed_ || !params_.homing; }
  const Resumption& gap() const noexcept { return gap_; }
  // GapBit, for the peer.
  std::uint32_t told_of_gap() const noexcept;

  static std::span<const Transition> transitions() noexcept;
  const Transition* taken() const noexcept { return taken_; }  // by the last step; null if it stayed

 private:
  void take(const Transition& row, Nanoseconds now, const EngagementInputs& in) noexcept;
  void watch_gap(Nanoseconds now, const EngagementInputs& in) noexcept;

  Role role_;
  EngagementParams params_;
  Resumption gap_;
  StationState state_ = StationState::kOff;
  Reason reason_ = Reason::kStart;
  const Transition* taken_ = nullptr;
  Nanoseconds since_ = 0, sound_since_ = 0;
  bool homed_ = false;
  bool peer_seen_disengaged_ = false;
  bool peer_seen_engaged_ = false;
};

}  // namespace farhand
