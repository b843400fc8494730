// Limits over time at the patient's hand: power, energy within a minute, warmth of the motor, time of a session. The
// settings are those of the box; nothing that comes over the network is an input here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace farhand {

struct PatientLimits {
  double power_w = 2.0;         // delivered to the hand
  double energy_j = 30.0;       // delivered to the hand within a minute
  double session_s = 3600.0;    // driven
  double continuous_a = 1.0;    // constant motor current that ends just at the limit of warmth
  double overload = 2.0;        // this many times that current, from cold,
  double overload_s = 300.0;    // reaches the limit in this time
  double surface_c = 41.0;      // that limit, at the surface
  double room_c = 23.2;         // temperature of the surface when cold
  double soft_start_s = 0.5;    // the gain of the network's commands rises from 0 to 1 in this time
  double let_go_after_s = 3.0;  // a hold by a limit ends in letting go, this much later
};

// Warmth of the motor: temperature of its surface above the room, as a share of the limit.
//
//   u' = ((I / I_c)^2 - u) / T      one node, heat I^2 R
//
// Mali & Munih 2006 (III-C) held a constant current. With 1 A the surface stays within 41 deg C, the limit for a part
// that touches a patient. With 2 A it reaches this within 5 min. Cooling below 25 deg C then takes 40 min. The first
// result gives u -> 1 at I_c = 1 A. The second, from cold, 1 = 2^2 (1 - exp(-300 s/T)), gives T = 300 s / ln(4/3) =
// 1043 s. The third gives the temperature of the room, which the paper does not state: (25 - T_r)/(41 - T_r) =
// exp(-2400 s/T) at T_r = 23.2 deg C. One thermal node thus explains all three results; there are no data to identify a
// second one. The current is constant within a step, therefore the step is exact: u += (1 - exp(-dt/T)) ((I/I_c)^2 -
// u).
class MotorHeat {
 public:
  MotorHeat(const PatientLimits& limits, double dt_s) noexcept;

  void step(double current_a, int ticks) noexcept;
  void start(double surface_c) noexcept;  // from a measured temperature, deg C; the model does not know earlier heating

  double share() const noexcept { return share_; }  // 1: at the limit
  double surface_c() const noexcept { return room_c_ + share_ * (limit_c_ - room_c_); }
  double time_constant_s() const noexcept { return T_; }

 private:
  double per_current2_, T_, room_c_, limit_c_, dt_s_, step_;
  double share_ = 0.0;
};

// Sum over a sliding minute in fixed memory: a bucket for each second, sixty full ones and the one that is being
// filled. The result is at least the sum of the last 60 s and at most that of the last 61 s: it is never too low.
class SlidingMinute {
 public:
  explicit SlidingMinute(double dt_s) noexcept : dt_s_(dt_s) {}

  void add(double amount, int ticks) noexcept;  // in the last `ticks` periods
  double sum() const noexcept { return sum_; }

 private:
  std::array<double, 61> bucket_{};
  std::size_t now_ = 0;
  double dt_s_, into_s_ = 0.0, sum_ = 0.0;
};

struct LimitReadings {
  double power_w = 0.0;    // torque on the hand times its speed; positive: the device gives power
  double current_a = 0.0;  // of the motor
  std::optional<double> surface_c = {};
  bool driven = false, engaged = false;
  int ticks = 1;  // periods since the last
};

// Result of the limits above: `hold` asks for Holding, `gain` is the gain of the network's commands. Reactions: the
// table in common/station/patient_guard.hpp.
struct LimitVerdict {
  bool hold = false;
  double gain = 1.0;
  std::uint32_t limits = 0, warnings = 0;
};

// Power is judged by its mean over 1/k_B, the time in which the bound at the person slows the axis down
// (common/station/person_bound.hpp). A shorter peak is no reason to let go of a stretched hand: near a limit of 0.5 W a
// single count of the encoder is a quarter of the limit, and once removed 1.4 N m from the hand within a tick.
class DoseLimits {
 public:
  DoseLimits(const PatientLimits& limits, double dt_s) noexcept;

  LimitVerdict step(const LimitReadings& now) noexcept;
  void begin_session() noexcept { driven_s_ = 0.0; }  // called on an act of the patient's side

  const MotorHeat& heat() const noexcept { return heat_; }
  double energy_j() const noexcept { return energy_.sum(); }
  double driven_s() const noexcept { return driven_s_; }

 private:
  static constexpr double kPowerFade = 0.05;  // share of the limit
  static constexpr double kPowerMean = 80.0;  // 1/s, k_B
  bool holds(double share, bool held, std::uint32_t bit, LimitVerdict& verdict) const noexcept;

  PatientLimits limits_;
  double dt_s_;
  MotorHeat heat_;
  SlidingMinute energy_;
  double driven_s_ = 0.0, held_s_ = 0.0, gain_ = 0.0, mean_w_ = 0.0;
  bool heat_started_ = false, hot_ = false, spent_ = false, over_ = false, let_go_ = false;
};

}  // namespace farhand
