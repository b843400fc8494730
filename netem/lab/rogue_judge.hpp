// Effects of a session on the person, measured at the person and compared with the limits of the acceptance. One file,
// to be read from top to bottom.
//
// While driven (Aligning, Engaged, Holding); energy and torque also for as long as torque is still given afterwards, as
// it fades out:
//   speed                 <= 1.1 limit
//   angle                 <= end of the range + 1 degree (+ 4 on a hand of 0.5 N m s/rad spastic damping)
//   energy in a window t  <= 1.1 (P t + J v_max^2 / 2), every window from 5 ms to the whole session
//   power over 50 ms      <= 1.1 (P + J v_max^2 / (2 * 50 ms)): 2.9 W at the defaults
//   power now             <= 1.1 P on a linear person up to 5 N m/rad, 1.5 P on a stiffer one
//   torque                commanded and of the spring <= limit + 0.05 N m, at the hand that + v sqrt(J K), at the
//                         therapist limit + 0.1 N m
//   jump of what is followed at a change of state <= 1 mrad beyond what velocity explains
// Not driven:
//   speed, power          <= 1.1 of the same person let go at the same angle and speed, or what driving allows
// From 0.8 s after the last packet, in Holding:
//   torque                <= K_p/K_f |x_hold - x| + 0.1 N m
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/station/tick_trace.hpp"
#include "netem/lab/rogue_release.hpp"

namespace farhand::rogue {

// States in which a motion is followed; homing and identification are led by the station itself.
constexpr bool drives(StationState state) noexcept {
  return state == StationState::kAligning || state == StationState::kEngaged || state == StationState::kHolding;
}

enum class Line : std::uint8_t {
  kTorqueCommanded,
  kTorqueOfSpring,
  kTorqueAtPerson,
  kSpeed,
  kAngle,
  kEnergy,
  kMeanPower,
  kPower,
  kSpeedLetGo,
  kPowerLetGo,
  kJump,
  kPressed,
  kAnySpeed,  // these have no bound: effect on the person in any state
  kAnyPower,
  kAnyAngle,
  kAnyTorque,
  kCount
};
inline constexpr std::size_t kLines = static_cast<std::size_t>(Line::kCount);
inline constexpr std::size_t kBoundLines = static_cast<std::size_t>(Line::kAnySpeed);
const char* name_of(Line line) noexcept;
const char* unit_of(Line line) noexcept;

// The worst value of a session against one limit.
struct Worst {
  double value = 0, bound = 0, t_s = 0;
  double ratio = 0;  // value over bound; of a line without a bound the value
};
using Findings = std::array<Worst, kLines>;

struct Allowed {
  Body body;
  bool therapist = false;
  double speed = 4, torque = 3, power = 2, range = 0.349;
  double hold_spring = 1.6;  // K_p/K_f, N m/rad
};

// The person at one instant.
struct AtPerson {
  double t_s = 0;
  BodyState body;
  double torque = 0;     // given by the device, positive in +
  double spring = 0;     // behind an MCU
  double commanded = 0;  // N m
  bool driven = false;   // by the state of the station, and by its MCU if there is one
};

class Judge {
 public:
  explicit Judge(const Allowed& allowed);

  void see(const AtPerson& now);
  // Once per tick of the station, after it.
  void see(const TickTrace<1>& trace, double t_s);
  void last_packet(double t_s) { last_packet_s_ = t_s; }

  const Findings& findings() const noexcept { return findings_; }
  double engaged_s() const noexcept { return engaged_s_; }

 private:
  void meet(Line line, double value, double bound);
  void see_windows(double given_j);
  void see_let_go(const AtPerson& now, double power);

  static constexpr double kShortest = 5e-3, kMean = 50e-3, kPressedAfter = 0.8;  // s
  static constexpr std::size_t kRing = 512;
  struct Account {
    double t_s, energy, excess;
  };

  Allowed allowed_;
  double store_;  // J v_max^2 / 2
  Findings findings_{};
  AtPerson before_;
  bool first_ = true;

  double energy_ = 0, least_excess_ = 0;
  double went_in_ = 0;  // rad/s, of late
  std::array<Account, kRing> accounts_{};
  std::size_t count_ = 0, for_shortest_ = 0, for_mean_ = 0;

  BodyState let_go_from_, torque_off_from_;
  LetGo reference_;
  bool reference_known_ = false;

  TickTrace<1> trace_before_;
  bool traced_ = false, changed_ = false;
  bool stood_ = false;  // what the peer tells: one packet was late, and the next brings the way of two
  double trace_t_s_ = 0, engaged_s_ = 0, x_hold_ = 0;
  double last_packet_s_ = 1e9;
};

}  // namespace farhand::rogue
