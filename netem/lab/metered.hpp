// A plant that also integrates, by the same integrator, the supplied and the dissipated energy, so that a run can be
// compared with d(stored) = supplied - dissipated.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/integrate/semi_implicit_euler.hpp"
#include "common/plant/power_flow.hpp"

namespace farhand {

template <class P>
class Metered {
 public:
  static constexpr std::size_t kStates = P::kStates + 2, kSupplied = P::kStates, kDissipated = kSupplied + 1;
  static constexpr std::size_t kGuards = P::kGuards;
  static constexpr std::array<bool, kStates> kPositions = [] {
    std::array<bool, kStates> all{};
    for (std::size_t i = 0; i < P::kStates; ++i) all[i] = is_position<P>(i);
    return all;
  }();
  using State = std::array<double, kStates>;
  using Own = typename P::State;

  explicit Metered(const P& plant) : plant_(plant) {}

  void hold(double input) noexcept { plant_.hold(input); }
  State start() const noexcept { return with(plant_.start(), 0.0, 0.0); }
  static Own own(const State& s) noexcept {
    Own x;
    std::copy_n(s.begin(), P::kStates, x.begin());
    return x;
  }
  // A state of the plant and what the meters show.
  static State with(const Own& x, double supplied, double dissipated) noexcept {
    State s;
    std::copy(x.begin(), x.end(), s.begin());
    s[kSupplied] = supplied, s[kDissipated] = dissipated;
    return s;
  }
  const P& plant() const noexcept { return plant_; }

  Mode mode_at(double t, const State& s) const noexcept { return plant_.mode_at(t, own(s)); }
  State derivative(Mode mode, double t, const State& s) const noexcept {
    const PowerFlow flow = plant_.power(mode, t, own(s));
    return with(plant_.derivative(mode, t, own(s)), flow.supplied, flow.dissipated);
  }
  // Exact for the plant; the meters' rows are differences, which affect only the meters' own accuracy.
  StateMatrix<kStates> jacobian(Mode mode, double t, const State& s) const noexcept {
    StateMatrix<kStates> J{};
    const auto inner = plant_.jacobian(mode, t, own(s));
    for (std::size_t j = 0; j < P::kStates; ++j) {
      for (std::size_t i = 0; i < P::kStates; ++i) J[i][j] = inner[i][j];
      Own up = own(s), down = up;  // a power is quadratic in most states: the difference is exact but for rounding
      const double step = 1e-6 * (1.0 + std::fabs(up[j]));
      up[j] += step, down[j] -= step;
      const PowerFlow above = plant_.power(mode, t, up), below = plant_.power(mode, t, down);
      J[kSupplied][j] = (above.supplied - below.supplied) / (2.0 * step);
      J[kDissipated][j] = (above.dissipated - below.dissipated) / (2.0 * step);
    }
    return J;
  }
  State time_derivative(Mode mode, double t, const State& s) const noexcept {
    constexpr double kStep = 1e-6;
    const PowerFlow later = plant_.power(mode, t + kStep, own(s)), sooner = plant_.power(mode, t - kStep, own(s));
    return with(plant_.time_derivative(mode, t, own(s)), (later.supplied - sooner.supplied) / (2.0 * kStep),
                (later.dissipated - sooner.dissipated) / (2.0 * kStep));
  }
  std::array<double, kGuards> guards(Mode mode, double t, const State& s) const noexcept {
    return plant_.guards(mode, t, own(s));
  }
  Mode cross(Mode mode, std::size_t guard, double t, State& s) const noexcept {
    Own x = own(s);
    const Mode next = plant_.cross(mode, guard, t, x);
    s = with(x, s[kSupplied], s[kDissipated]);
    return next;
  }
  double next_break(double t) const noexcept { return plant_.next_break(t); }
  void decide(double t, const State& s) noexcept requires requires(P& p, const Own& x) { p.decide(t, x); }
  { plant_.decide(t, own(s)); }

 private:
  P plant_;
};

}  // namespace farhand
