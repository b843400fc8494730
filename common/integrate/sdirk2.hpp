// The singly diagonally implicit Runge-Kutta method of order 2 with gamma = 1 - 1/sqrt 2. It is L-stable, and its
// second stage is the result: a mode much faster than the step has decayed after one step, whatever its length.
//
//   Y1 = x + gamma h f(t + gamma h, Y1),   y = Y2 = x + (1 - gamma) h k1 + gamma h f(t + h, Y2)
#pragma once

#include <cmath>

#include "common/integrate/lu.hpp"
#include "common/integrate/step_work.hpp"

namespace farhand {

struct Sdirk2 {
  static constexpr int kOrder = 2;
  static constexpr const char* kName = "SDIRK2";
  static constexpr Method kMethod = Method::kSdirk2;
  static constexpr bool kEmbedded = false;
  static constexpr double kGamma = 0.29289321881345247560;  // 1 - 1/sqrt 2

  // Returns false if Newton's method does not converge: then the step is too long for the plant's nonlinearity.
  template <Plant P>
  static bool step(const P& plant, Mode mode, double t, const typename P::State& x, double h, typename P::State& y,
                   Work<P>& work) noexcept {
    auto J = work.start_jacobian(plant, mode, t, x);
    Lu<P::kStates> lu;
    if (!lu.factor(kGamma * h, J)) return false;
    y = x;
    if (!newton(plant, mode, t + kGamma * h, x, kGamma * h, y, work.k[0], J, lu, work)) return false;
    const auto base = along(x, (1.0 - kGamma) * h, work.k[0]);
    y = along(base, kGamma * h, work.k[0]);
    return newton(plant, mode, t + h, base, kGamma * h, y, work.k[1], J, lu, work);
  }

  // Interpolant of second order. It does not use the slope at the start, which is useless just after a fast mode was
  // excited.
  template <Plant P>
  static DenseOutput<P::kStates> dense(const typename P::State& x, double h, const typename P::State&,
                                       const Work<P>& work) noexcept {
    DenseOutput<P::kStates> path;
    path.c[0] = x;
    for (std::size_t i = 0; i < P::kStates; ++i) {
      const double k1 = work.k[0][i], k2 = work.k[1][i];
      path.c[1][i] = h / (1.0 - kGamma) * (k1 - kGamma * k2);
      path.c[2][i] = h / (1.0 - kGamma) * 0.5 * (k2 - k1);
    }
    return path;
  }

 private:
  static constexpr int kMaxIterations = 20;
  // Largest residual of an equation, relative to its terms. Rounding leaves about 1e-15.
  static constexpr double kEnough = 1e-13;
  static constexpr double kEnoughIfItFallsNoMore = 1e-9;

  // Solves Y = base + a f(t, Y), k = f(t, Y). One iteration suffices if f is affine. The Jacobian of the start is used
  // as long as each iteration reduces the residual tenfold.
  template <Plant P>
  static bool newton(const P& plant, Mode mode, double t, const typename P::State& base, double a, typename P::State& Y,
                     typename P::State& k, StateMatrix<P::kStates>& J, Lu<P::kStates>& lu, Work<P>& work) noexcept {
    double last = HUGE_VAL;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      const auto f = work.derivative(plant, mode, t, Y);
      typename P::State residual;
      double size = 0;
      for (std::size_t i = 0; i < P::kStates; ++i) {
        double terms = std::fabs(Y[i]) + std::fabs(base[i]);
        for (std::size_t j = 0; j < P::kStates; ++j) terms += a * std::fabs(J[i][j] * Y[j]);
        residual[i] = base[i] + a * f[i] - Y[i];
        if (!std::isfinite(residual[i])) return false;
        if (residual[i] != 0) size = std::fmax(size, std::fabs(residual[i]) / terms);
      }
      // Only after a first iteration: a creeping motion is smaller than this in a step, and would stop.
      const bool enough = size == 0 || (size <= kEnough && iteration > 0);
      if (enough || (size <= kEnoughIfItFallsNoMore && size > 0.5 * last)) {
        // Not from f: in a stiff plant f amplifies the remaining residual.
        for (std::size_t i = 0; i < P::kStates; ++i) k[i] = (Y[i] - base[i]) / a;
        return true;
      }
      if (size > 0.1 * last) {
        J = plant.jacobian(mode, t, Y);
        ++work.counters.jacobians;
        if (!lu.factor(a, J)) return false;
      }
      last = size;
      lu.solve(residual);
      for (std::size_t i = 0; i < P::kStates; ++i) Y[i] += residual[i];
    }
    return false;
  }
};

}  // namespace farhand
