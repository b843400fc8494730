// Implementation of a plant of a bare loop, for the sources that compile it: the product's own world for its methods,
// and the solver itself for methods that the product lacks: CVODE, and the closed form in long double.
#pragma once

#include <array>
#include <concepts>
#include <stdexcept>
#include <string>

#include "common/config/world_params.hpp"
#include "common/integrate/closed_form.hpp"
#include "common/plant/encoder.hpp"
#include "netem/lab/bare_plant.hpp"
#include "netem/lab/cvode.hpp"

namespace farhand {

inline const char* failure_of(IntegratorStatus status) noexcept {
  return status == IntegratorStatus::kOk ? nullptr : name_of(status).data();
}

template <class World>
class WorldPlant final : public BarePlant<double> {
 public:
  explicit WorldPlant(World world) : world_(std::move(world)) {}

  double angle() const noexcept override { return world_.encoder(); }
  double motor_angle() const noexcept override { return world_.motor_encoder(); }
  void advance(double input, double t1) noexcept override { world_.advance(input, t1); }
  BareTruth truth() const noexcept override {
    return {world_.true_x(), world_.true_f(), failure_of(world_.status()), world_.counters().steps,
            world_.counters().events};
  }

 private:
  World world_;
};

template <class T>
T read_encoder(T x, double counts_per_rev) noexcept {
  return counts_per_rev > 0 ? static_cast<T>(quantised(static_cast<double>(x), counts_per_rev)) : x;
}

// State 0 is the angle; the angle of a separate motor is state 2.
template <class T, class P, class Solver>
class SolvedPlant final : public BarePlant<T> {
 public:
  SolvedPlant(const P& plant, Solver solver, double counts_per_rev, double motor_counts_per_rev)
      : plant_(plant),
        solver_(std::move(solver)),
        counts_per_rev_(counts_per_rev),
        motor_counts_per_rev_(motor_counts_per_rev) {
    typename Solver::State start;
    for (std::size_t i = 0; i < start.size(); ++i) start[i] = plant_.start()[i];
    solver_.start(plant_, 0.0, start);
  }

  T angle() const noexcept override { return read_encoder(static_cast<T>(solver_.state()[0]), counts_per_rev_); }
  T motor_angle() const noexcept override {
    if constexpr (requires { plant_.motor_encoder(plant_.start()); }) {
      return read_encoder(static_cast<T>(solver_.state()[2]), motor_counts_per_rev_);
    } else {
      return angle();
    }
  }
  void advance(T input, double t1) noexcept override {
    plant_.hold(input);
    solver_.advance(plant_, t1);
  }
  BareTruth truth() const noexcept override {
    typename P::State state;
    for (std::size_t i = 0; i < state.size(); ++i) state[i] = static_cast<double>(solver_.state()[i]);
    const auto truth = plant_.truth(solver_.time(), state);
    return {truth.x, truth.f, failure_of(solver_.status()), solver_.counters().steps, solver_.counters().events};
  }

 private:
  P plant_;
  Solver solver_;
  double counts_per_rev_, motor_counts_per_rev_;
};

// Rounding the input to double would be the largest error of a reference in long double; the rounded part is added to
// the flow.
template <class P>
class LongHeld : public P {
 public:
  using P::P;
  explicit LongHeld(const P& plant) : P(plant) {}

  void hold(long double input) noexcept {
    const double rounded = static_cast<double>(input);
    P::hold(rounded);
    rest_ = input - static_cast<long double>(rounded);
  }
  template <class T>
  AffineFlow<T, P::kStates> flow(Mode mode) const noexcept {
    AffineFlow<T, P::kStates> flow = P::template flow<T>(mode);
    if constexpr (P::kStates == 2) {
      flow.b[1] += static_cast<T>(rest_) * flow.e[1];  // a torque, as the forcing is; none where the axis sticks
    } else {
      flow.b[3] -= static_cast<T>(rest_) * flow.A[3][3];  // a velocity of the motor; in saturation it has no rest
    }
    return flow;
  }

 private:
  long double rest_ = 0;
};

struct EncoderCounts {
  double joint = 0, motor = 0;  // per revolution; 0: ideal
};

// The solvers that no world has.
template <class T, class P>
std::unique_ptr<BarePlant<T>> solved(const P& plant, const BareChoice& choice, const EncoderCounts& counts) {
  const auto with = [&counts]<class Held>(const Held& held, auto solver) {
    return std::make_unique<SolvedPlant<T, Held, decltype(solver)>>(held, std::move(solver), counts.joint,
                                                                    counts.motor);
  };
  if constexpr (std::same_as<T, double>) {
    const CvodeMethod method = choice.method == BareMethod::kCvodeBdf ? CvodeMethod::kBdf : CvodeMethod::kAdams;
    return with(plant, CvodeIntegrator<P>(method, choice.rtol, 1e-2 * choice.rtol));
  } else {
    if constexpr (requires { plant.template flow<T>(Mode{}); })
      return with(LongHeld<P>(plant), ClosedForm<LongHeld<P>, T>());
    throw std::invalid_argument(std::string("the closed form cannot propagate this plant: ") + plant.not_affine());
  }
}

// The same for plants whose type depends on the friction.
template <class T, template <Friction> class PlantWith, class Params>
std::unique_ptr<BarePlant<T>> solved_axis(const Params& params, const BareChoice& choice) {
  const EncoderCounts counts{params.motor.encoder_counts_per_rev, 0};
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return solved<T>(PlantWith<Friction::kCoulomb>(params), choice, counts);
    case Friction::kBristle:
      return solved<T>(PlantWith<Friction::kBristle>(params), choice, counts);
    case Friction::kNone:
      break;
  }
  return solved<T>(PlantWith<Friction::kNone>(params), choice, counts);
}

inline bool is_cvode(BareMethod method) { return method == BareMethod::kCvodeBdf || method == BareMethod::kCvodeAdams; }

// The product's own method with the settings of the choice, stable or not, so that the effect of too long a step is
// shown.
inline WorldNumerics numerics_of(const scene::Scene& scene, const BareChoice& choice) {
  if (choice.method == BareMethod::kWorld) return world_numerics(scene);
  constexpr std::array kOfWorld{Method::kSemiImplicitEuler, Method::kRk4,      Method::kSdirk2,
                                Method::kRosenbrock,        Method::kAdaptive, Method::kClosedForm};
  WorldNumerics out;
  out.method = kOfWorld.at(static_cast<std::size_t>(choice.method));
  out.even_if_unstable = true;
  if (choice.step_s > 0) out.settings.max_step = choice.step_s;
  if (choice.rtol > 0) {
    out.settings.max_step = 1.0;
    out.settings.rtol = choice.rtol;
    out.settings.atol = 1e-2 * choice.rtol;
  }
  return out;
}

}  // namespace farhand
