// A person who is let go: the same hand or arm in the same device, from an angle and a speed, without torque from then
// on. No limit can prevent the motion by its own spring; the time after letting go is judged against this motion.
#pragma once

namespace farhand::rogue {

inline constexpr double kFrozen = 5e-3;  // s, time for which an encoder is frozen
inline bool frozen(double from_s, double t_s) noexcept {
  return from_s >= 0 && t_s >= from_s && t_s < from_s + kFrozen;
}

struct BodyState {
  double x = 0, v = 0, motor_x = 0, motor_v = 0;
  double x_shown = 0;  // by the joint's encoder: x, but while it stands
  double x_slow = 0;   // its low-pass, from which the velocity is that the motor follows
  double t_s = 0;
};

struct Body {
  double J, viscous;  // of the device, kg m2, N m s/rad
  double K, B;        // of the person, around 0 rad
  double spastic = 0, spastic_above = 0.2;
  double J_person = 0;   // part of J that is the person's
  double stop = 0.5236;  // rad, both ways
  double spring = 0;     // N m/rad, behind an MCU; 0: a direct drive
  double motor_hz = 30, motor_limit = 4, spring_gain = 10;
  double velocity_cutoff = 0;  // rad/s, of the joint's velocity that the motor follows; 0: as it is
  double fastest = 1e9;        // rad/s, that it follows
  double frozen_from_s = -1;   // the joint's encoder stands; < 0: never

  double followed(const BodyState& s) const noexcept;
  double reaction(double x, double v) const noexcept;  // without the person's inertia
};

struct LetGo {
  double speed = 0, power = 0;  // the most, rad/s, W given to the person
};

// Behind an MCU the motor follows the joint as fast as it can, so that the spring gives no torque. An encoder that is
// frozen in that time is frozen in this reference too, because it is the same device.
LetGo let_go(const Body& body, BodyState from) noexcept;

}  // namespace farhand::rogue
