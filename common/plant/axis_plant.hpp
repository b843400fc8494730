// A motor axis with its load, in the form that an integrator needs. The load of the master is the therapist's arm; the
// load of a slave with an ideal device is the environment in the patient's box.
//
//   (J + J_load) a = tau - resistance(x, v) - friction - reaction of the load
//
// The torque tau is held between control ticks. Without a bristle and without weight it is affine in every mode.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "common/integrate/affine.hpp"
#include "common/integrate/stiffness.hpp"
#include "common/plant/environment.hpp"
#include "common/plant/motor_axis.hpp"
#include "common/plant/therapist.hpp"

namespace farhand {

constexpr double kFastHand = 20;  // rad/s

template <class Load>
struct AxisParams {
  MotorAxis::Params motor = {};
  typename Load::Params load = {};
  double start = 0;  // rad, of the device and of the intended motion
};

template <class Load>
struct AxisTruth : Load::Truth {
  double x, v, f;  // rad, rad/s, N m in the sign of Motion::f
};

template <class Load, Friction kFriction>
class AxisPlant {
 public:
  static constexpr bool kHasBristle = kFriction == Friction::kBristle;
  static constexpr bool kHasCoulomb = kFriction == Friction::kCoulomb;
  static constexpr bool kHasFriction = kFriction != Friction::kNone;
  static constexpr std::size_t kStates = kHasBristle ? 3 : 2;  // x, v, torque of the bristle
  static constexpr std::size_t kFrictionGuard = 2 + Load::kGuards;
  static constexpr std::size_t kGuards = kFrictionGuard + (kHasFriction ? 1 : 0);
  static constexpr bool kInputMovesGuards = kHasCoulomb;  // the torque that breaks away
  static constexpr bool kLoadDecides = requires(const Load& load) { load.next_decision(); };
  using State = std::array<double, kStates>;
  using Params = AxisParams<Load>;
  using Truth = AxisTruth<Load>;

  // Throws std::invalid_argument if the friction of the motor is of another kind.
  explicit AxisPlant(const Params& params)
      : axis_(params.motor),
        load_(params.load, params.start),
        bristle_(params.motor.bristle.value_or(Bristle::Params{})),
        coulomb_(params.motor.coulomb),
        J_(params.motor.J + load_.inertia()),
        start_(params.start),
        free_(load_.free_range(axis_.stops().free_range())) {
    if (params.motor.friction() != kFriction) throw std::invalid_argument("this plant is made for another friction");
  }

  void hold(double torque) noexcept { torque_ = torque; }
  // The held torque, with the part that the load holds between ticks.
  double held() const noexcept {
    if constexpr (kLoadDecides)
      return torque_ + load_.held_torque();
    else
      return torque_;
  }
  // Time of the next decision of the load, a person, and the decision.
  double next_decision() const noexcept requires kLoadDecides { return load_.next_decision(); }
  double decision_tick() const noexcept requires kLoadDecides { return load_.decision_tick(); }
  void decide(double t, const State& s) noexcept requires kLoadDecides { load_.decide(t, s[0]); }
  State start() const noexcept {
    State s{};
    s[0] = start_;
    return s;
  }

  Mode mode_at(double t, const State& s) const noexcept {
    Mode mode = mode_at(t, s, 0.0);
    // At rest on a border the acceleration decides.
    if (s[1] == 0) mode = mode_at(t, s, derivative(mode, t, s)[1]);
    return mode;
  }

  State derivative(Mode mode, double t, const State& s) const noexcept {
    if (sticks(mode)) return {};
    double torque = free_torque(mode, t, s[0], s[1]);
    if constexpr (kHasCoulomb) torque -= direction(mode) * coulomb_;
    if constexpr (kHasBristle) {
      const double z_rate = bristle_.rate(direction(mode), s[1], s[2]);
      return {s[1], (torque - bristle_.torque(s[2], s[1], z_rate)) / J_, bristle_.params().sigma_0 * z_rate};
    } else {
      return {s[1], torque / J_};
    }
  }
  StateMatrix<kStates> jacobian(Mode mode, double t, const State& s) const noexcept {
    StateMatrix<kStates> J{};
    if (sticks(mode)) return J;
    J[0][1] = 1.0;
    J[1][0] = -(axis_.stiffness(mode, s[0]) + load_.stiffness(mode, t)) / J_;
    J[1][1] = -(axis_.damping(mode) + load_.damping(mode)) / J_;
    if constexpr (kHasBristle) {
      const Bristle::Slopes slopes = bristle_.slopes(direction(mode), s[1], s[2]);
      J[1][1] -= slopes.torque_v / J_;
      J[1][2] = -slopes.torque_F / J_;
      J[2][1] = bristle_.params().sigma_0 * slopes.rate_v;
      J[2][2] = bristle_.params().sigma_0 * slopes.rate_F;
    }
    return J;
  }
  State time_derivative(Mode mode, double t, const State& s) const noexcept {
    State d{};
    if (!sticks(mode)) d[1] = -load_.reaction_rate(mode, t, s[0]) / J_;
    return d;
  }

  // No contact is closed, and both ends of the step are further from all contacts than the axis could have gone and
  // come back: 4 times its motion plus its speeds times h. A cubic leaves the range between its ends by 4/27 of the
  // latter.
  bool keeps_clear(Mode mode, const State& from, const State& to, double h) const noexcept requires(!kHasFriction) {
    const double away = 4.0 * (std::fabs(to[0] - from[0]) + h * (std::fabs(from[1]) + std::fabs(to[1])));
    return (mode & kTouching) == 0 && !load_.watches_speed(mode) && to[0] - free_.low > away &&
           free_.high - to[0] > away;
  }
  // Stops, load, friction.
  std::array<double, kGuards> guards(Mode mode, double t, const State& s) const noexcept {
    std::array<double, kGuards> all;
    const auto stops = axis_.stops().guards(mode, s[0], s[1]);
    const auto load = load_.guards(mode, s[0], s[1]);
    std::copy(load.begin(), load.end(), std::copy(stops.begin(), stops.end(), all.begin()));
    if constexpr (kHasBristle) all[kFrictionGuard] = direction(mode) * s[1] + kRestVelocity;
    if constexpr (kHasCoulomb) {
      all[kFrictionGuard] =
          sticks(mode) ? coulomb_ - std::fabs(free_torque(mode, t, s[0], 0.0)) : direction(mode) * s[1];
    }
    return all;
  }
  Mode cross(Mode mode, std::size_t guard, double t, State& s) const noexcept {
    if (guard < 2) return mode ^ Stops<>::bit(guard);
    if (guard < kFrictionGuard) return mode ^ Load::bit(guard - 2);
    if constexpr (kHasCoulomb) {
      const bool stuck = sticks(mode);
      s[1] = 0.0;
      const double torque = free_torque(mode, t, s[0], 0.0);
      if (!stuck && std::fabs(torque) <= coulomb_) return (mode & ~kSlidesBack) | kSticking;
      return (mode & ~(kSlidesBack | kSticking)) | (torque < 0 ? kSlidesBack : 0u);
    }
    return mode ^ kSlidesBack;
  }
  double next_break(double t) const noexcept { return load_.next_break(t); }

  // nullptr if it is affine in every mode; else why not.
  const char* not_affine() const noexcept {
    if (kHasBristle) return "the bristle's torque is multiplied by the speed";
    return axis_.gravity() > 0 ? "weight acts by the sine of the angle" : load_.not_affine();
  }
  template <class T>
  AffineFlow<T, kStates> flow(Mode mode) const noexcept requires(!kHasBristle) {
    AffineFlow<T, kStates> flow;
    if (sticks(mode)) return flow;
    const AffineForm<T, kStates> torque = free_torque_form<T>(mode);
    const T J = T(axis_.J()) + T(load_.inertia());
    flow.A[0][1] = 1;
    for (std::size_t i = 0; i < kStates; ++i) flow.A[1][i] = torque.c[i] / J;
    flow.b[1] = (torque.d - (kHasCoulomb ? T(direction(mode)) * T(coulomb_) : T(0))) / J;
    flow.e[1] = T(1) / J;
    return flow;
  }
  template <class T>
  std::array<T, kStates> held_gain(Mode mode) const noexcept requires(!kHasBristle) {
    return {T(0), sticks(mode) ? T(0) : T(1) / (T(axis_.J()) + T(load_.inertia()))};
  }
  template <class T>
  Forcing<T> forcing(double t) const noexcept requires(!kHasBristle) {
    return load_.template forcing<T>(t);
  }
  template <class T>
  std::array<AffineGuard<T, kStates>, kGuards> guard_forms(Mode mode) const noexcept requires(!kHasBristle) {
    using Guard = AffineGuard<T, kStates>;
    std::array<Guard, kGuards> all;
    const auto stops = axis_.stops().template guard_forms<T, kStates>(mode);
    const auto load = load_.template guard_forms<T, kStates>(mode);
    std::copy(load.begin(), load.end(), std::copy(stops.begin(), stops.end(), all.begin()));
    if constexpr (kHasCoulomb) {
      Guard& friction = all[kFrictionGuard];
      if (sticks(mode)) {  // F_c - torque and F_c + torque
        friction.kind = Guard::Kind::kMin;
        friction.second = free_torque_form<T>(mode);
        friction.second.c[1] = 0;
        friction.first = {{-friction.second.c[0], 0}, T(coulomb_) - friction.second.d, -friction.second.h};
        friction.second.d += T(coulomb_);
      } else {
        friction.kind = Guard::Kind::kOne;
        friction.first.c[1] = T(direction(mode));
      }
    }
    return all;
  }

  double encoder(const State& s) const noexcept { return axis_.encoder(s[0]); }
  // True values under the held torque. f: torque of the therapist, or of hand and wall, against the device.
  Truth truth(double t, const State& s) const noexcept {
    const Mode mode = mode_at(t, s);
    const double a = derivative(mode, t, s)[1];
    return {{load_.truth(t)}, s[0], s[1], load_.inertia() * a + load_.reaction(mode, t, s[0], s[1])};
  }
  double stored_energy(double t, const State& s) const noexcept {
    double energy = axis_.stored_energy(s[0], s[1]) + load_.stored_energy(t, s[0], s[1]);
    if constexpr (kHasBristle) energy += bristle_.stored_energy(s[2]);
    return energy;
  }
  PowerFlow power(Mode mode, double t, const State& s) const noexcept {
    const PowerFlow load = load_.power(mode, t, s[0], s[1]);
    PowerFlow flow{torque_ * s[1] + load.supplied, axis_.dissipated_power(mode, s[0], s[1]) + load.dissipated};
    if constexpr (kHasCoulomb) flow.dissipated += coulomb_ * direction(mode) * s[1];
    if constexpr (kHasBristle) {
      flow.dissipated += bristle_.dissipated_power(s[1], s[2], bristle_.rate(direction(mode), s[1], s[2]));
    }
    return flow;
  }

  // States at which the plant is stiffest: in contact and free; with a bristle also at rest, at a reversal, and at a
  // speed that no hand exceeds.
  template <class Self = AxisPlant>  // complete only when it is asked
  std::vector<Situation<Self>> situations() const {
    std::vector<Situation<Self>> all;
    for (const Mode stops : {Mode{0}, kAtStopMax}) {
      for (const Mode load : {Mode{0}, load_.everything()}) {
        State s{};
        s[0] = axis_.hanging();
        all.push_back({stops | load, 0.0, s});
        if constexpr (kHasBristle) {
          for (const auto& [v, F_b] : bristle_.extremes(kFastHand)) {
            s[1] = v, s[2] = F_b;
            all.push_back({stops | load, 0.0, s});
          }
        }
      }
    }
    return all;
  }

 private:
  static bool sticks(Mode mode) noexcept { return kHasCoulomb && (mode & kSticking) != 0; }

  Mode mode_at(double t, const State& s, double a) const noexcept {
    Mode mode = axis_.mode_at(s[0], s[1], a) | load_.mode_at(t, s[0], s[1], a);
    if constexpr (kHasBristle) {
      if (s[1] < 0) mode |= kSlidesBack;
    }
    if constexpr (kHasCoulomb) {
      const double torque = s[1] == 0 ? free_torque(mode, t, s[0], 0.0) : s[1];
      if (s[1] == 0 && std::fabs(torque) <= coulomb_) {
        mode |= kSticking;
      } else if (torque < 0) {
        mode |= kSlidesBack;
      }
    }
    return mode;
  }
  // Without dry friction.
  double free_torque(Mode mode, double t, double x, double v) const noexcept {
    const double own = torque_ - axis_.resistance(mode, x, v);
    return load_.acts(mode) ? own - load_.reaction(mode, t, x, v) : own;
  }
  template <class T>
  AffineForm<T, kStates> free_torque_form(Mode mode) const noexcept {
    constexpr double kAnyTime = 0;  // no stiffness of an affine load follows it
    AffineForm<T, kStates> torque;
    torque.c[0] = -(T(axis_.stops().stiffness(mode)) + T(load_.stiffness(mode, kAnyTime)));
    torque.c[1] = -(T(axis_.damping(mode)) + T(load_.damping(mode)));
    torque.d = T(held()) - axis_.stops().reaction(mode, T(0), T(0)) + load_.template fixed_torque<T>(mode);
    torque.h = 1;
    return torque;
  }

  MotorAxis axis_;
  Load load_;
  Bristle bristle_;
  double coulomb_, J_, start_;
  FreeRange free_;
  double torque_ = 0;
};

template <Friction kFriction>
using MasterPlantWith = AxisPlant<Therapist, kFriction>;
template <Friction kFriction>
using DirectSlavePlantWith = AxisPlant<Environment, kFriction>;
using MasterPlant = MasterPlantWith<Friction::kNone>;
using DirectSlavePlant = DirectSlavePlantWith<Friction::kNone>;

}  // namespace farhand
