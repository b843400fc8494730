// The bare loop: both laws on both plants over a constant delay, nothing else. It is linear between samples; therefore
// an exact second computation exists: the same equations written by hand in long double, both plants advanced by the
// closed form of a damped oscillator, and the eigenvalues of the whole.
#pragma once

#include <string>

#include "netem/lab/extreme.hpp"

namespace farhand::extreme {

struct LoopSide {
  double J = 0.004, viscous = 0.002;
  double J_n = 0.004, viscous_n = 0.002;
  double stiffness = 3, damping = 0.06, inertia = 0.001;  // of the person, two-sided, around `rest`
  double rest = 0;
  double start = 0;
  double encoder_counts_per_rev = 0;
};

struct LoopPlan {
  LoopSide master{.rest = 0.1, .start = 0.1};
  LoopSide slave{.stiffness = 2, .damping = 0.02, .inertia = 0, .rest = 0.05};
  double K_p = 400, K_d = 40, K_f = 250;
  double g_dis = 200, g_reac = 200, g_v = 500;
  double dt = 1e-3;
  int delay_ticks = 1;
  std::uint64_t ticks = 3000;
  double meter = 0.06;  // pieces of the energy balance, in units of the fastest motion
};

// error: largest distance of a position of the product from the exact one, over the largest position so far: relative.
// `what` names the spectral radius and the behaviour of the loop. An unstable loop is followed until it has grown 1e6
// times.
Outcome run_loop(const LoopPlan& plan);

Case loop_case(std::string family, std::string name, Expected expected, LoopPlan plan);

// Largest |eigenvalue| of one period.
double spectral_radius(const LoopPlan& plan);

}  // namespace farhand::extreme
