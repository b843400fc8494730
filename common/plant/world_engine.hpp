// Implementation of a world, for the sources that compile it: one family of plants each, under every method.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "common/integrate/closed_form.hpp"
#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "common/plant/world.hpp"
#include "common/plant/world_method.hpp"

namespace farhand {

// Solver: Integrator<Scheme, P> or ClosedForm<P>.
template <class P, class Solver>
class EngineOf final : public WorldEngine<typename P::Truth> {
 public:
  EngineOf(const P& plant, Method method, const MethodChoice& choice, const IntegratorSettings& settings)
      : plant_(plant), solver_(settings), method_(method), choice_(choice) {
    solver_.start(plant_, 0.0, plant_.start());
  }

  void advance(double input, double t1_s) noexcept override {
    plant_.hold(input);
    if constexpr (kDecides) decide_until(t1_s);
    if (!kDecides || solver_.time() < t1_s) solver_.advance(plant_, t1_s);
  }
  typename P::Truth truth() const noexcept override { return plant_.truth(solver_.time(), solver_.state()); }
  double encoder() const noexcept override { return plant_.encoder(solver_.state()); }
  double motor_encoder() const noexcept override {
    if constexpr (requires { plant_.motor_encoder(solver_.state()); }) {
      return plant_.motor_encoder(solver_.state());
    } else {
      return encoder();
    }
  }
  double stored_energy() const noexcept override { return plant_.stored_energy(solver_.time(), solver_.state()); }
  PowerFlow power() const noexcept override {
    const double t = solver_.time();
    return plant_.power(plant_.mode_at(t, solver_.state()), t, solver_.state());
  }
  Method method() const noexcept override { return method_; }
  const MethodChoice& choice() const noexcept override { return choice_; }
  IntegratorCounters counters() const noexcept override { return solver_.counters(); }
  IntegratorStatus status() const noexcept override { return solver_.status(); }

 private:
  static constexpr bool kDecides = requires(const P& plant) { plant.next_decision(); };

  // A person decides at his own times; several of them may lie in one advance. A time that differs from the end only by
  // rounding belongs to this advance.
  void decide_until(double t1_s) noexcept requires kDecides {
    while (true) {
      const double due = plant_.next_decision();
      if (!std::isfinite(due)) return;
      const double rounding = 1e-6 * plant_.decision_tick();
      if (due > t1_s + rounding) return;
      solver_.advance(plant_, due < t1_s - rounding ? due : t1_s);
      plant_.decide(solver_.time(), solver_.state());
    }
  }

  P plant_;
  Solver solver_;
  Method method_;
  MethodChoice choice_;
};

template <class P>
std::unique_ptr<WorldEngine<typename P::Truth>> make_engine_of(const typename P::Params& params,
                                                               const WorldNumerics& numerics) {
  const P plant(params);
  const IntegratorSettings& settings = numerics.settings;
  const auto situations = plant.situations();
  const MethodChoice choice = choose(plant, settings.max_step, std::span<const Situation<P>>(situations));
  const Method method = numerics.method == Method::kAuto ? choice.method : numerics.method;
  const auto engine = [&]<class Solver>() {
    return std::make_unique<EngineOf<P, Solver>>(plant, method, choice, settings);
  };
  switch (method) {
    case Method::kSemiImplicitEuler:
      if (!numerics.even_if_unstable) check_stable(plant, method, settings.max_step);
      return engine.template operator()<Integrator<SemiImplicitEuler, P>>();
    case Method::kSdirk2:
      return engine.template operator()<Integrator<Sdirk2, P>>();
    case Method::kRosenbrock:
      return engine.template operator()<Integrator<Rosenbrock, P>>();
    case Method::kAdaptive:
      return engine.template operator()<Integrator<DormandPrince, P>>();
    case Method::kClosedForm:
      if (plant.not_affine() != nullptr)
        throw std::invalid_argument(std::string("world.method = CLOSED_FORM cannot advance this world: ") +
                                    plant.not_affine() + "; give another method or AUTO");
      if constexpr (AffinePlant<P>) return engine.template operator()<ClosedForm<P>>();
      break;
    case Method::kAuto:
    case Method::kRk4:
      break;
  }
  if (!numerics.even_if_unstable) check_stable(plant, method, settings.max_step);
  return engine.template operator()<Integrator<Rk4, P>>();
}

}  // namespace farhand
