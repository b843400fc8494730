// Bounds speed, power and range at the person in an axis that takes a torque. The bound uses the present torque, speed
// and angle and not the power delivered, which is known 16 ms late: a power of 2 W can be exceeded within 40 ms.
//
//   a <= k_B (v_allow - v),   v_allow = min( v_max, P / (tau + 0.1 N m), v_end(way) )
//
// and the same in the other direction. tau is the torque against the direction: the largest of the present torque, of
// the torque predicted for its present growth over 1.5/k_B (the therapist: 1/k_B), and of the torque that was given.
// For the power of a hand the bound is raised by the growth of the torque in 1/g_dis, the delay with which the observer
// adds it; otherwise nobody could be led at 1.8 W into a stiff hand. It is raised by no more than the resistance of a
// hand of 16 N m/rad grows at this speed, because noise grows too. v_end is the speed from which the axis can come to
// rest within the distance (way) to the end of the range: as a low-pass of k_E close to the end, and with the
// deceleration b further away, v_end (v_end + 2 b/k_E) = 2 b way.
//
// The bound limits the acceleration and not the torque, because the disturbance observer adds the person's resistance:
// speed then approaches v_allow like a low-pass of k_B, whoever pushes. (A limit on the torque would chatter: a fade
// over a tenth of the limit is a gain of 75 N m s/rad on 4 g m2, and the speed is known 3 ms late.)
//
// A person who moves outward, or fast, by himself is not held: for range and power the bound is raised by the
// acceleration with which he pushes in this direction, -tau_dis/J_n. Above v_max he is braked as well, because a hand
// that was stretched and is let go springs back faster.
//
// A therapist's own motion (free) is never slowed. It is the motion that the axis would make without commands of the
// peer, a = -K_f f, an inertia of 1/K_f. The energy that he received, plus the kinetic energy of that inertia,
//
//   A = int f dx + v^2 / (2 K_f) >= 0
//
// shows whether the device moves him: then he is braked as a hand is. (The error of the observers while he moves is a
// share of his kinetic energy.) While he has received almost no energy the peer may lead him slightly beyond the bound,
// so that a fast motion of his own is followed without any change.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/signal/limit_bits.hpp"
#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"
#include "common/station/gate_params.hpp"

namespace farhand {

template <int N>
class PersonBound {
 public:
  // J_n: kg m2, of the axis; g_dis: of its disturbance observer; K_f: 1/(kg m2), of its law.
  PersonBound(const PersonBoundParams& params, const GateParams& gate, double J_n, Cutoff g_dis, double K_f,
              double dt_s) noexcept
      : p_(params),
        J_n_(J_n),
        K_f_(K_f),
        ahead_(params.free ? 0.0 : kBrake * std::min(kMostAhead, 1.0 / g_dis.rad_s()) / J_n),
        f_slow_(Cutoff::rad_s(kBrake), dt_s) {
    limit(gate);
  }

  // Forgets the energy given so far.
  void reset() noexcept {
    given_.setZero();
    f_slow_.reset(Joints<N>::Zero());
    begun_ = false;
  }

  void limit(const GateParams& gate) noexcept {  // from now on
    acceleration_ = gate.acceleration;
    range_min_ = gate.range_min;
    range_max_ = gate.range_max;
    bounds_ = std::isfinite(acceleration_) || std::isfinite(p_.speed) || std::isfinite(p_.power);
  }

  // Returns the acceleration to ask for, rad/s2, before the observer's torque is added. tau: torque applied since the
  // last tick; tau_dis: torque of the disturbance observer, positive if it resists rising angles.
  Joints<N> step(const Joints<N>& a_ref, const Motion<N>& local, const Joints<N>& tau,
                 const Joints<N>& tau_dis) noexcept;

  std::uint32_t active() const noexcept { return active_; }  // LimitBit

 private:
  struct Along {  // one direction
    double a_own, v, f, tau, tau_dis, way;
    double ahead;  // rad/s2, from the growth of f
  };
  // The largest acceleration along a direction; records the limit that makes it less than asked for.
  double most(const Along& now, double asked) noexcept;

  static double end_speed(double way) noexcept {
    constexpr double kCorner = kSlowing / kEnd;
    return way > 0.0 ? std::sqrt(kCorner * kCorner + 2 * kSlowing * way) - kCorner : 0.0;
  }

  static constexpr double kMost = 10.0;     // J
  static constexpr double kMoved = 0.0625;  // share of J v_max^2; and
  static constexpr double kWrong = 0.35;    // of the kinetic energy: threshold of being moved, fully from 1.5 times it
  static constexpr double kLed = 0.5;       // share of the threshold from which on he is led
  static constexpr double kBeyond = 60.0;   // rad/s2, by which the peer may lead him beyond the bound below that
  static constexpr double kBrake = 80.0;    // 1/s: torque is known 5 ms late, speed 3
  static constexpr double kLead = 1.5, kLeadFree = 1.0;  // times the growth of f within 1/k_B
  static constexpr double kStiffest = 16.0;              // N m/rad, stiffest resistance for which growth is added
  static constexpr double kMostAhead = 5e-3;             // s, 1/g_dis of the default scenes
  static constexpr double kEnd = 25.0;                   // 1/s
  static constexpr double kSlowing = 100.0;              // rad/s2
  static constexpr double kAlways = 0.1;                 // N m
  PersonBoundParams p_;
  double J_n_, K_f_, ahead_;  // ahead_: rad/s2 per N m of growth
  LowPass<N> f_slow_;
  Joints<N> given_ = Joints<N>::Zero();  // J, int f dx
  double moved_ = 0.0, led_ = 0.0;
  double acceleration_ = 0.0, range_min_ = 0.0, range_max_ = 0.0;
  Joints<N> x_before_ = Joints<N>::Zero(), f_before_ = Joints<N>::Zero();
  bool begun_ = false;
  bool bounds_ = false;
  std::uint32_t active_ = 0;
};

template <int N>
Joints<N> PersonBound<N>::step(const Joints<N>& a_ref, const Motion<N>& local, const Joints<N>& tau,
                               const Joints<N>& tau_dis) noexcept {
  active_ = 0;
  if (!bounds_) return a_ref;
  const Joints<N> a_own = -K_f_ * local.f;
  if (p_.free) {
    const Joints<N> kinetic = local.v * local.v / (2 * K_f_);
    // Energy from the measured distance, not from the speed: the encoder's counts disturb speed and torque alike, and
    // the product of the two errors would remove 80 mW from an axis that rests on the edge of a count.
    if (begun_) given_ += f_before_ * (local.x - x_before_);
    given_ = given_.max(-kinetic).min(kMost - kinetic);
    x_before_ = local.x;
    f_before_ = local.f;
    begun_ = true;
    const double threshold = kMoved * J_n_ * p_.speed * p_.speed + kWrong * kinetic.sum();
    const double share = (given_ + kinetic).sum() / threshold;
    moved_ = std::clamp(2.0 * (share - 1.0), 0.0, 1.0);
    led_ = std::clamp(2.0 * (share - kLed), 0.0, 1.0);
  }
  const Joints<N> grown = local.f - f_slow_.step(local.f), ahead = ahead_ * grown;
  const Joints<N> f_soon = local.f + (p_.free ? kLeadFree : kLead) * grown;
  Joints<N> a = a_ref;
  for (int i = 0; i < N; ++i) {
    const double high = most(
        {a_own[i], local.v[i], std::max(f_soon[i], local.f[i]), tau[i], tau_dis[i], range_max_ - local.x[i], ahead[i]},
        a[i]);
    const double low = -most({-a_own[i], -local.v[i], -std::min(f_soon[i], local.f[i]), -tau[i], -tau_dis[i],
                              local.x[i] - range_min_, -ahead[i]},
                             -a[i]);
    // If both bounds act (too fast in one direction while pulled in the other) the braking one has priority.
    a[i] = std::clamp(a[i], std::min(low, high), std::max(low, high));
    if (a[i] > acceleration_ || a[i] < -acceleration_) active_ |= kLimitAcceleration;
    a[i] = std::clamp(a[i], -acceleration_, acceleration_);
  }
  return a;
}

template <int N>
double PersonBound<N>::most(const Along& now, double asked) noexcept {
  const double against = std::max(0.0, -now.tau_dis) / J_n_;  // of a person who pushes in this direction
  const double by_speed = kBrake * (p_.speed - now.v);
  const double by_power = kBrake * (p_.power / (std::max({0.0, now.f, now.tau}) + kAlways) - now.v) + against +
                          std::clamp(now.ahead, 0.0, kStiffest * ahead_ / kBrake * std::max(now.v, 0.0));
  const double by_range = kBrake * (end_speed(now.way) - now.v) + against;
  double least = std::min({by_speed, by_power, by_range});
  const std::uint32_t bit = least == by_speed ? kLimitVelocity : least == by_power ? kLimitPower : kLimitRange;
  if (p_.free) {
    const double freely = least + (1.0 - moved_) * std::max(0.0, now.a_own - least);
    least = freely + (1.0 - led_) * std::clamp(asked - freely, 0.0, kBeyond);
  }
  if (asked > least) active_ |= bit;
  return least;
}

}  // namespace farhand
