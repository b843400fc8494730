// The sides of a bare loop behind one virtual call per tick, for the sources that compile them: laws, plants, frictions
// and integrators multiply.
#pragma once

#include <type_traits>

#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/integrate/closed_form.hpp"
#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "tests/lab/bare_orthosis.hpp"
#include "tests/lab/bare_run.hpp"
#include "tests/lab/bare_world.hpp"
#include "tests/lab/cvode.hpp"

namespace farhand {

// The truth of one side.
struct BareTruth {
  double x = 0, f = 0;
  const char* failure = nullptr;  // nullptr: as asked so far
  std::uint64_t steps = 0, events = 0;
};

template <class T>
class BareSide {
 public:
  virtual ~BareSide() = default;
  virtual Sent<T> step(const Sent<T>& received, double t0, double t1) noexcept = 0;
  virtual BareTruth truth() const noexcept = 0;
};

template <class T>
std::unique_ptr<BareSide<T>> make_bare_master(const scene::Scene& scene, const BareChoice& choice);
template <class T>
std::unique_ptr<BareSide<T>> make_bare_slave(const scene::Scene& scene, const BareChoice& choice);

template <class Side>
class BareSideOf final : public BareSide<typename Side::Real> {
 public:
  using T = typename Side::Real;
  explicit BareSideOf(Side side) : side_(std::move(side)) {}

  Sent<T> step(const Sent<T>& received, double t0, double t1) noexcept override { return side_.step(received, t0, t1); }
  BareTruth truth() const noexcept override {
    const auto& solver = side_.solver();
    if constexpr (requires { solver.world(); }) {
      const auto& world = solver.world();
      return {world.true_x(), world.true_f(), failure_of(world.status()), world.counters().steps,
              world.counters().events};
    } else {
      std::array<double, std::tuple_size_v<std::decay_t<decltype(solver.state())>>> state;
      for (std::size_t i = 0; i < state.size(); ++i) state[i] = static_cast<double>(solver.state()[i]);
      const auto truth = side_.plant().truth(solver.time(), state);
      return {truth.x, truth.f, failure_of(solver.status()), solver.counters().steps, solver.counters().events};
    }
  }

 private:
  static const char* failure_of(IntegratorStatus status) noexcept {
    return status == IntegratorStatus::kOk ? nullptr : name_of(status).data();
  }

  Side side_;
};

// Rounding the input to double would be the largest error of a reference in long double: what it loses is added to the
// flow.
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

// build(plant, solver) for the integrator that was chosen.
template <class T, class P, class Build>
std::unique_ptr<BareSide<T>> with_solver(const P& plant, const BareChoice& choice, Build&& build) {
  IntegratorSettings settings;
  if (choice.step_s > 0) settings.max_step = choice.step_s;
  if (choice.rtol > 0) {
    settings.max_step = 1.0;
    settings.rtol = choice.rtol;
    settings.atol = 1e-2 * choice.rtol;
  }
  if constexpr (std::same_as<T, long double>) {
    if constexpr (requires { plant.template flow<T>(Mode{}); }) {
      using Long = LongHeld<P>;
      return build(Long(plant), ClosedForm<Long, T>(settings));
    }
  } else {
    switch (choice.method) {
      case BareMethod::kSemiImplicitEuler:
        return build(plant, Integrator<SemiImplicitEuler, P>(settings));
      case BareMethod::kRk4:
        return build(plant, Integrator<Rk4, P>(settings));
      case BareMethod::kSdirk2:
        return build(plant, Integrator<Sdirk2, P>(settings));
      case BareMethod::kRosenbrock:
        return build(plant, Integrator<Rosenbrock, P>(settings));
      case BareMethod::kAdaptive:
        return build(plant, Integrator<DormandPrince, P>(settings));
      case BareMethod::kCvodeBdf:
        return build(plant, CvodeIntegrator<P>(CvodeMethod::kBdf, settings.rtol, settings.atol));
      case BareMethod::kCvodeAdams:
        return build(plant, CvodeIntegrator<P>(CvodeMethod::kAdams, settings.rtol, settings.atol));
      case BareMethod::kClosedForm:
      case BareMethod::kClosedFormLong:
      case BareMethod::kWorld:
        if constexpr (requires { plant.template flow<T>(Mode{}); }) return build(plant, ClosedForm<P, T>(settings));
    }
  }
  throw std::invalid_argument(std::string("the closed form cannot propagate this plant: ") + plant.not_affine());
}

}  // namespace farhand
