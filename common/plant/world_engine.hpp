// What stands behind a world, for the sources that compile it.
#pragma once

#include <sstream>

#include "common/integrate/rk4.hpp"
#include "common/plant/world.hpp"

namespace farhand {

template <class P>
class EngineOf final : public WorldEngine<typename P::Truth> {
 public:
  EngineOf(const typename P::Params& params, const WorldNumerics& numerics)
      : smooth_{P(params)}, state_(smooth_.plant.start()), step_(numerics.settings.max_step) {
    const double longest = kRk4StableRadius / smooth_.plant.fastest_rate();
    if (step_ > 0 && step_ <= longest) return;
    std::ostringstream message;
    message << "world.step_s = " << step_
            << " s is too long for this world: its fastest motion or stiffest contact needs more than 0 and at most "
            << longest << " s";
    throw std::invalid_argument(message.str());
  }

  void advance(double input, double t0_s, double t1_s) noexcept override {
    smooth_.plant.hold(input);
    rk4_advance(smooth_, state_, t0_s, t1_s, step_);
    t_ = t1_s;
  }
  typename P::Truth truth() const noexcept override { return smooth_.plant.truth(t_, state_); }
  double encoder() const noexcept override { return smooth_.plant.encoder(state_); }
  double motor_encoder() const noexcept override {
    if constexpr (requires { smooth_.plant.motor_encoder(state_); }) {
      return smooth_.plant.motor_encoder(state_);
    } else {
      return encoder();
    }
  }
  double stored_energy() const noexcept override { return smooth_.plant.stored_energy(t_, state_); }
  Method method() const noexcept override { return Method::kRk4; }
  IntegratorCounters counters() const noexcept override { return {}; }
  IntegratorStatus status() const noexcept override { return IntegratorStatus::kOk; }

 private:
  struct Smooth {
    using State = typename P::State;
    P plant;
    State derivative(double t, const State& s) const noexcept { return plant.derivative(plant.mode_at(t, s), t, s); }
  };
  Smooth smooth_;
  typename P::State state_;
  double step_, t_ = 0;
};

}  // namespace farhand
