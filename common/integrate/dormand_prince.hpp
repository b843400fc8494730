// The embedded pair 5(4) of Dormand and Prince (1980) with the continuous extension of order 4 (Hairer, Norsett,
// Wanner: Solving Ordinary Differential Equations I, II.5 and II.6). Its seventh stage is the slope at the end, which
// the next step begins with.
#pragma once

#include <array>

#include "common/integrate/step_work.hpp"

namespace farhand {

struct DormandPrince {
  static constexpr int kOrder = 5;
  static constexpr const char* kName = "adaptive";
  static constexpr Method kMethod = Method::kAdaptive;
  static constexpr bool kEmbedded = true;

  template <Plant P>
  static bool step(const P& plant, Mode mode, double t, const typename P::State& x, double h, typename P::State& y,
                   Work<P>& work) noexcept {
    auto& k = work.k;
    k[0] = work.start_slope(plant, mode, t, x);
    for (std::size_t stage = 1; stage < 7; ++stage) {
      for (std::size_t i = 0; i < P::kStates; ++i) {
        double sum = 0;
        for (std::size_t j = 0; j < stage; ++j) sum += kA[stage][j] * k[j][i];
        y[i] = x[i] + h * sum;
      }
      k[stage] = work.derivative(plant, mode, t + kC[stage] * h, y);
    }
    for (std::size_t i = 0; i < P::kStates; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < 7; ++j) sum += kE[j] * k[j][i];
      work.error[i] = h * sum;
    }
    return true;
  }

  template <Plant P>
  static DenseOutput<P::kStates> dense(const typename P::State& x, double h, const typename P::State& y,
                                       const Work<P>& work) noexcept {
    DenseOutput<P::kStates> path;
    path.c[0] = x;
    for (std::size_t i = 0; i < P::kStates; ++i) {
      double quartic = 0;
      for (std::size_t j = 0; j < 7; ++j) quartic += kD[j] * work.k[j][i];
      quartic *= h;
      const double rise = y[i] - x[i];
      const double bend = h * work.k[0][i] - rise;
      const double twist = rise - h * work.k[6][i] - bend;
      path.c[1][i] = rise + bend;
      path.c[2][i] = twist - bend + quartic;
      path.c[3][i] = -twist - 2.0 * quartic;
      path.c[4][i] = quartic;
    }
    return path;
  }

 private:
  static constexpr std::array<double, 7> kC{0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
  // The last row is the result of order 5.
  static constexpr std::array<std::array<double, 6>, 7> kA{
      {{},
       {1.0 / 5},
       {3.0 / 40, 9.0 / 40},
       {44.0 / 45, -56.0 / 15, 32.0 / 9},
       {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
       {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
       {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}}};
  // Result of order 5 less that of order 4.
  static constexpr std::array<double, 7> kE{71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                            -17253.0 / 339200, 22.0 / 525, -1.0 / 40.0};
  static constexpr std::array<double, 7> kD{-12715105075.0 / 11282082432,  0,
                                            87487479700.0 / 32700410799,   -10690763975.0 / 1880347072,
                                            701980252875.0 / 199316789632, -1453857185.0 / 822651844,
                                            69997945.0 / 29380423};
};

}  // namespace farhand
