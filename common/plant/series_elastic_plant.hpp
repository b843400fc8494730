// The patient's side with the hand orthosis: a motor whose command is a velocity, a spring, and behind the tendons the
// joint with the hand's inertia, which touches a hand, a wall, both or nothing (Daud 2011, 5.2.2: velocity-sourced
// series elastic actuator; all angles are converted to the joint).
//
//   v_motor' = 2 pi bandwidth (clamp(u) - v_motor)                 the drive's own loop, first order
//   J v' = spring(x_motor - x) - viscous v - friction - stops - f
//
// Friction acts behind the spring, so that the spring, which is the torque sensor, does not measure it. A spring with a
// limited range ends in a stiff one: there the torque is larger than k times its stretch.
#pragma once

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "common/integrate/affine.hpp"
#include "common/integrate/stiffness.hpp"
#include "common/plant/encoder.hpp"
#include "common/plant/environment.hpp"
#include "common/plant/friction.hpp"
#include "common/plant/stops.hpp"

namespace farhand {

struct SeriesElasticParams {
  struct Actuator {
    double spring = 10;
    double spring_range = 0;  // rad of stretch to each side; 0: no end
    double J = 0.004;         // joint with hand
    double viscous = 0.002;
    std::optional<Bristle::Params> tendon = std::nullopt;
    double motor_bandwidth_hz = 30;
    double motor_speed_limit = 4;
    double joint_counts_per_rev = 20000;  // 0: ideal
    double motor_counts_per_rev = 20000;  // seen at the joint; 0: ideal
    double stop_min = -0.5236;
    double stop_max = 0.5236;
  };
  Actuator actuator = {};
  Environment::Params environment = {};
  double start = 0;    // rad, of the joint
  double stretch = 0;  // rad, of the spring at the start

  Friction friction() const noexcept { return actuator.tendon ? Friction::kBristle : Friction::kNone; }
};

struct SeriesElasticTruth {
  double x, v, f;  // rad, rad/s, N m in the sign of Motion::f; without the friction of the tendons
  double motor_x, motor_v, spring_torque, tendon_torque;
};

template <Friction kFriction>
class SeriesElasticPlantWith {
 public:
  static_assert(kFriction != Friction::kCoulomb, "the friction of the tendons is a bristle");
  static constexpr bool kHasBristle = kFriction == Friction::kBristle;
  enum Index : std::size_t { kX, kV, kXMotor, kVMotor, kTendon };
  static constexpr std::size_t kStates = kHasBristle ? 5 : 4;
  // Stops, wall and hand, ends of the spring, friction.
  static constexpr std::size_t kEndsGuard = 2 + Environment::kGuards, kFrictionGuard = kEndsGuard + 2;
  static constexpr std::size_t kGuards = kFrictionGuard + (kHasBristle ? 1 : 0);
  static constexpr bool kInputMovesGuards = false;
  using State = std::array<double, kStates>;
  using Params = SeriesElasticParams;
  using Truth = SeriesElasticTruth;

  // Throws std::invalid_argument if the friction is of another kind.
  explicit SeriesElasticPlantWith(const Params& params)
      : p_(params.actuator),
        drive_rate_(2.0 * std::numbers::pi * params.actuator.motor_bandwidth_hz),
        bristle_(params.actuator.tendon.value_or(Bristle::Params{})),
        stops_(params.actuator.stop_min, params.actuator.stop_max, params.actuator.J),
        ends_(-params.actuator.spring_range, params.actuator.spring_range, params.actuator.J),
        environment_(params.environment),
        start_(params.start),
        stretch_(params.stretch) {
    if (params.friction() != kFriction) throw std::invalid_argument("this plant is made for another friction");
  }

  // rad/s of the motor.
  void hold(double v_command) noexcept {
    v_allowed_ = std::clamp(v_command, -p_.motor_speed_limit, p_.motor_speed_limit);
  }
  double held() const noexcept { return v_allowed_; }
  State start() const noexcept {
    State s{};
    s[kX] = start_;
    s[kXMotor] = start_ + stretch_;
    return s;
  }

  Mode mode_at(double t, const State& s) const noexcept {
    Mode mode = mode_at(t, s, 0.0, 0.0);
    if (s[kV] == 0) {  // at rest on a border the sign of the acceleration decides
      const State d = derivative(mode, t, s);
      mode = mode_at(t, s, d[kV], d[kVMotor]);
    }
    return mode;
  }

  State derivative(Mode mode, double t, const State& s) const noexcept {
    const double torque = spring_torque(mode, s) - p_.viscous * s[kV] - stops_.reaction(mode, s[kX], s[kV]) -
                          environment_.reaction(mode, t, s[kX], s[kV]);
    const double a_motor = drive_rate_ * (v_allowed_ - s[kVMotor]);
    if constexpr (kHasBristle) {
      const double z_rate = bristle_.rate(direction(mode), s[kV], s[kTendon]);
      return {s[kV], (torque - bristle_.torque(s[kTendon], s[kV], z_rate)) / p_.J, s[kVMotor], a_motor,
              bristle_.params().sigma_0 * z_rate};
    } else {
      return {s[kV], torque / p_.J, s[kVMotor], a_motor};
    }
  }
  StateMatrix<kStates> jacobian(Mode mode, double t, const State& s) const noexcept {
    const AffineForm<double, 4> torque = torque_form<double>(mode, t);
    StateMatrix<kStates> J{};
    J[kX][kV] = J[kXMotor][kVMotor] = 1.0;
    for (std::size_t i = 0; i < 4; ++i) J[kV][i] = torque.c[i] / p_.J;
    J[kVMotor][kVMotor] = -drive_rate_;
    if constexpr (kHasBristle) {
      const Bristle::Slopes slopes = bristle_.slopes(direction(mode), s[kV], s[kTendon]);
      J[kV][kV] -= slopes.torque_v / p_.J;
      J[kV][kTendon] = -slopes.torque_F / p_.J;
      J[kTendon][kV] = bristle_.params().sigma_0 * slopes.rate_v;
      J[kTendon][kTendon] = bristle_.params().sigma_0 * slopes.rate_F;
    }
    return J;
  }
  State time_derivative(Mode mode, double t, const State& s) const noexcept {
    State d{};
    d[kV] = -environment_.reaction_rate(mode, t, s[kX]) / p_.J;
    return d;
  }

  std::array<double, kGuards> guards(Mode mode, double /*t*/, const State& s) const noexcept {
    std::array<double, kGuards> all;
    const auto stops = stops_.guards(mode, s[kX], s[kV]);
    const auto touched = environment_.guards(mode, s[kX], s[kV]);
    const auto ends = has_ends() ? ends_.guards(mode, s[kXMotor] - s[kX], s[kVMotor] - s[kV])
                                 : std::array<double, 2>{kNoGuard, kNoGuard};
    const auto next = std::copy(touched.begin(), touched.end(), std::copy(stops.begin(), stops.end(), all.begin()));
    std::copy(ends.begin(), ends.end(), next);
    if constexpr (kHasBristle) all[kFrictionGuard] = direction(mode) * s[kV] + kRestVelocity;
    return all;
  }
  Mode cross(Mode mode, std::size_t guard, double /*t*/, State& /*s*/) const noexcept {
    if (guard < 2) return mode ^ Stops<>::bit(guard);
    if (guard < kEndsGuard) return mode ^ Environment::bit(guard - 2);
    if (guard < kFrictionGuard) return mode ^ Ends::bit(guard - kEndsGuard);
    return mode ^ kSlidesBack;
  }
  double next_break(double t) const noexcept { return environment_.next_break(t); }

  const char* not_affine() const noexcept {
    return kHasBristle ? "the bristle's torque is multiplied by the speed" : environment_.not_affine();
  }
  template <class T>
  AffineFlow<T, kStates> flow(Mode mode) const noexcept requires(!kHasBristle) {
    constexpr double kAnyTime = 0;  // no stiffness of an affine environment follows it
    const AffineForm<T, 4> torque = torque_form<T>(mode, kAnyTime);
    AffineFlow<T, kStates> flow;
    flow.A[kX][kV] = flow.A[kXMotor][kVMotor] = 1;
    for (std::size_t i = 0; i < kStates; ++i) flow.A[kV][i] = torque.c[i] / T(p_.J);
    flow.A[kVMotor][kVMotor] = -T(drive_rate_);
    flow.b[kV] = torque.d / T(p_.J);
    flow.b[kVMotor] = T(drive_rate_) * T(v_allowed_);
    if (environment_.forced()) flow.e[kV] = T(1) / T(p_.J);
    return flow;
  }
  template <class T>
  std::array<T, kStates> held_gain(Mode /*mode*/) const noexcept requires(!kHasBristle) {
    return {T(0), T(0), T(0), T(drive_rate_)};
  }
  template <class T>
  Forcing<T> forcing(double t) const noexcept requires(!kHasBristle) {
    return environment_.forcing<T>(t);
  }
  template <class T>
  std::array<AffineGuard<T, kStates>, kGuards> guard_forms(Mode mode) const noexcept requires(!kHasBristle) {
    std::array<AffineGuard<T, kStates>, kGuards> all;
    const auto stops = stops_.guard_forms<T, kStates>(mode);
    const auto touched = environment_.guard_forms<T, kStates>(mode);
    std::copy(touched.begin(), touched.end(), std::copy(stops.begin(), stops.end(), all.begin()));
    if (has_ends()) {
      const auto ends = ends_.template guard_forms<T, kStates>(mode);
      all[kEndsGuard] = stretch_guard(ends[0]), all[kEndsGuard + 1] = stretch_guard(ends[1]);
    }
    return all;
  }

  double encoder(const State& s) const noexcept { return quantised(s[kX], p_.joint_counts_per_rev); }
  double motor_encoder(const State& s) const noexcept { return quantised(s[kXMotor], p_.motor_counts_per_rev); }
  Truth truth(double t, const State& s) const noexcept {
    const Mode mode = mode_at(t, s);
    double tendon = 0;
    if constexpr (kHasBristle) {
      tendon = bristle_.torque(s[kTendon], s[kV], bristle_.rate(direction(mode), s[kV], s[kTendon]));
    }
    return {s[kX], s[kV], environment_.reaction(mode, t, s[kX], s[kV]), s[kXMotor], s[kVMotor], spring_torque(mode, s),
            tendon};
  }
  // The motor is a source of velocity: its own inertia is not part of the balance.
  double stored_energy(double t, const State& s) const noexcept {
    const double stretch = s[kXMotor] - s[kX];
    double energy = 0.5 * p_.J * s[kV] * s[kV] + 0.5 * p_.spring * stretch * stretch + stops_.stored_energy(s[kX]) +
                    environment_.stored_energy(t, s[kX], s[kV]);
    if (has_ends()) energy += ends_.stored_energy(stretch);
    if constexpr (kHasBristle) energy += bristle_.stored_energy(s[kTendon]);
    return energy;
  }
  PowerFlow power(Mode mode, double t, const State& s) const noexcept {
    PowerFlow flow = environment_.power(mode, t, s[kX], s[kV]);
    flow.supplied += spring_torque(mode, s) * s[kVMotor];
    flow.dissipated += p_.viscous * s[kV] * s[kV] + stops_.dissipated_power(mode, s[kX], s[kV]);
    if (has_ends()) flow.dissipated += ends_.dissipated_power(mode, s[kXMotor] - s[kX], s[kVMotor] - s[kV]);
    if constexpr (kHasBristle) {
      flow.dissipated +=
          bristle_.dissipated_power(s[kV], s[kTendon], bristle_.rate(direction(mode), s[kV], s[kTendon]));
    }
    return flow;
  }

  // States at which the plant is stiffest: in contact and free; with a bristle also at rest, at a reversal, and at
  // twice the speed of the motor (the spring can throw the joint ahead).
  template <class Self = SeriesElasticPlantWith>  // complete only when it is asked
  std::vector<Situation<Self>> situations() const {
    std::vector<Situation<Self>> all;
    for (const Mode stops : {Mode{0}, kAtStopMax}) {
      for (const Mode end : {Mode{0}, has_ends() ? kSpringAtMax : 0u}) {
        for (const Mode touched : {Mode{0}, environment_.everything()}) {
          State s{};
          all.push_back({stops | end | touched, 0.0, s});
          if constexpr (kHasBristle) {
            for (const auto& [v, F_b] : bristle_.extremes(2.0 * p_.motor_speed_limit)) {
              s[kV] = v, s[kTendon] = F_b;
              all.push_back({stops | end | touched, 0.0, s});
            }
          }
        }
      }
    }
    return all;
  }

 private:
  using Ends = Stops<kSpringAtMin, kSpringAtMax>;

  bool has_ends() const noexcept { return p_.spring_range > 0; }
  Mode mode_at(double t, const State& s, double a, double a_motor) const noexcept {
    Mode mode = stops_.mode_at(s[kX], s[kV], a) | environment_.mode_at(t, s[kX], s[kV], a);
    if (has_ends()) mode |= ends_.mode_at(s[kXMotor] - s[kX], s[kVMotor] - s[kV], a_motor - a);
    if constexpr (kHasBristle) {
      if (s[kV] < 0) mode |= kSlidesBack;
    }
    return mode;
  }
  double spring_torque(Mode mode, const State& s) const noexcept {
    const double stretch = s[kXMotor] - s[kX];
    const double end = has_ends() ? ends_.reaction(mode, stretch, s[kVMotor] - s[kV]) : 0.0;
    return p_.spring * stretch + end;
  }
  // All torque on the joint except the friction of the tendons.
  template <class T>
  AffineForm<T, 4> torque_form(Mode mode, double t) const noexcept {
    const T k = T(p_.spring) + T(ends_.stiffness(mode)), b = T(ends_.damping(mode));
    AffineForm<T, 4> torque;
    torque.c[kX] = -(k + T(stops_.stiffness(mode)) + T(environment_.stiffness(mode, t)));
    torque.c[kV] = -(b + T(p_.viscous) + T(stops_.damping(mode)) + T(environment_.damping(mode)));
    torque.c[kXMotor] = k;
    torque.c[kVMotor] = b;
    torque.d =
        ends_.reaction(mode, T(0), T(0)) - stops_.reaction(mode, T(0), T(0)) + environment_.fixed_torque<T>(mode);
    return torque;
  }
  // From a form of x and v to the same form of the stretch.
  template <class T>
  static AffineGuard<T, kStates> stretch_guard(AffineGuard<T, kStates> guard) noexcept {
    for (AffineForm<T, kStates>* form : {&guard.first, &guard.second}) {
      form->c[kXMotor] = form->c[kX];
      form->c[kVMotor] = form->c[kV];
      form->c[kX] = -form->c[kX];
      form->c[kV] = -form->c[kV];
    }
    return guard;
  }

  SeriesElasticParams::Actuator p_;
  double drive_rate_;
  Bristle bristle_;
  Stops<> stops_;
  Ends ends_;
  Environment environment_;
  double start_, stretch_;
  double v_allowed_ = 0;
};

using SeriesElasticPlant = SeriesElasticPlantWith<Friction::kNone>;

}  // namespace farhand
