// The vocabulary of the state machine: roles, acts of the operator, reasons for a change of state. The states
// themselves are in common/link/packet.hpp, because their numbers are on the wire.
#pragma once

#include <initializer_list>

#include "common/link/packet.hpp"
#include "common/signal/role.hpp"

namespace farhand {

enum class OperatorAct : std::uint8_t { kNone, kEngage, kHold, kStop, kReset, kHome, kIdentify, kSweep };

// Reason for the last change of state; in events and on the status line.
enum class Reason : std::uint8_t {
  kNone,
  kStart,
  kOperator,
  kPeerSilent,
  kPeerFault,
  kPeerStopped,
  kPeerLetGo,
  kPeerEngaged,
  kAligned,
  kTimeout,
  kDeviceFound,
  kDeviceLost,
  kNotFinite,
  kTested,
  kOutOfRange,
  kNotAtRest,
  kHomed,
  kBlocked,
  kPatientLimit,
  kEncoderJump,
  kEncoderFrozen,
  kSpringDisagrees,
  kShaken,
  kIdentified,
  kAnotherAxis,
  kTherapistLimit,
  kLineLags,
  kLineSlow,
  kSwept,
  kResisted,
  kUneven,
  kPeerDeaf,
  kResumed
};

class StateSet {
 public:
  constexpr StateSet(std::initializer_list<StationState> states) noexcept {
    for (const StationState state : states) bits_ |= 1u << static_cast<int>(state);
  }
  static constexpr StateSet all_but(StateSet others) noexcept {
    others.bits_ = ~others.bits_;
    return others;
  }
  constexpr bool has(StationState state) const noexcept { return (bits_ >> static_cast<int>(state) & 1u) != 0; }

 private:
  std::uint32_t bits_ = 0;
};

// Torque or motion that a state asks of the axis.
enum class Asks : std::uint8_t {
  kNothing,  // no torque, at once
  kWeight,   // only its weight and friction are compensated
  kMotion    // the law follows a motion
};

constexpr Asks asks_of(StationState state) noexcept {
  switch (state) {
    case StationState::kReady:
      return Asks::kWeight;
    case StationState::kHoming:
    case StationState::kIdentifying:
    case StationState::kSweeping:
    case StationState::kAligning:
    case StationState::kEngaged:
    case StationState::kHolding:
      return Asks::kMotion;
    case StationState::kOff:
    case StationState::kSelfTest:
    case StationState::kFault:
    case StationState::kStopped:
      break;
  }
  return Asks::kNothing;
}

constexpr const char* name_of(StationState state) noexcept {
  constexpr const char* kNames[] = {"ready",     "aligning", "engaged", "holding",     "fault",   "off",
                                    "self-test", "homing",   "stopped", "identifying", "sweeping"};
  return kNames[static_cast<int>(state)];
}
constexpr const char* name_of(OperatorAct act) noexcept {
  constexpr const char* kNames[] = {"nothing", "engage", "hold", "stop", "reset", "home", "identify", "friction"};
  return kNames[static_cast<int>(act)];
}
constexpr const char* name_of(Reason reason) noexcept {
  constexpr const char* kNames[] = {"none",
                                    "start",
                                    "operator",
                                    "peer silent",
                                    "peer in fault",
                                    "peer stopped",
                                    "peer let go",
                                    "peer engaged",
                                    "aligned",
                                    "timeout",
                                    "device found",
                                    "device lost",
                                    "reading is not a number",
                                    "tested",
                                    "reading out of range",
                                    "device is not at rest",
                                    "homed",
                                    "blocked",
                                    "patient's limit",
                                    "encoder jumps",
                                    "encoder is frozen",
                                    "spring and its sensor disagree",
                                    "shaken",
                                    "identified",
                                    "axis is not as the scene says",
                                    "therapist's limit",
                                    "serial line lags by 20 ms",
                                    "serial line takes over 8 ms: see its latency timer",
                                    "friction measured",
                                    "something resists: a hand in the device?",
                                    "friction is not even: is something touched?",
                                    "peer heard nothing",
                                    "gap of the network is over"};
  return kNames[static_cast<int>(reason)];
}
constexpr const char* name_of(Asks asks) noexcept {
  constexpr const char* kNames[] = {"nothing", "weight", "motion"};
  return kNames[static_cast<int>(asks)];
}

}  // namespace farhand
