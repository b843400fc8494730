#include "netem/lab/simulated_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "netem/lab/bare_law.hpp"

namespace farhand {
namespace {

// J x'' + b x' + k x = tau over one period of held torque: Taylor series over parts of it.
class ExactAxis {
 public:
  ExactAxis(const LoadedAxis& axis, double dt)
      : axis_(axis),
        parts_(1 + static_cast<int>(4 * dt * (std::sqrt(axis.k / axis.J) + axis.b / axis.J))),
        h_(dt / parts_) {}
  void advance(double tau) {
    for (int i = 0; i < parts_; ++i) {
      double dx = v_, dv = (tau - axis_.b * v_ - axis_.k * x_) / axis_.J, factor = h_, x = x_, v = v_;
      for (int order = 1; order <= 8; ++order) {
        x += factor * dx;
        v += factor * dv;
        const double next = (-axis_.b * dv - axis_.k * dx) / axis_.J;
        dx = dv;
        dv = next;
        factor *= h_ / (order + 1);
      }
      x_ = x, v_ = v;
    }
  }
  double x_ = 0, v_ = 0;

 private:
  LoadedAxis axis_;
  int parts_;
  double h_;
};

std::unique_ptr<BareLaw<double>> law_of(const SideLoop& loop) {
  ControlParams scene;
  DriveParams& p = scene.drive;
  p.model = {.J_n = loop.J_n, .viscous = loop.viscous};
  p.K = {loop.K_p, loop.K_d, loop.K_f};
  p.g_dis = Cutoff::rad_s(loop.g_dis);
  p.g_reac = Cutoff::rad_s(loop.g_reac);
  p.g_v = Cutoff::rad_s(loop.g_v);
  p.gate = {.torque = 1e12, .torque_rate = 1e15, .velocity = 1e9, .range_min = -1e12, .range_max = 1e12};
  p.take_over_s = loop.dt;
  p.dt_s = loop.dt;
  return make_block_law("FOUR_CHANNEL", scene);
}

double energy_put_in(const SampledWall& wall, double K, double theta, int samples, Between between) {
  constexpr double kPhase = 0.3;  // sampled at its zeros a sine of half the sampling rate would not be seen
  const auto x = [&](double n) { return std::cos(theta * n + kPhase); };
  double energy = 0;
  for (int n = 0; n < samples; ++n) {
    const double tau = -K * x(n) - wall.B * (x(n) - x(n - 1)) / wall.T;
    const int parts = between == Between::kSine ? 16 : 1;
    for (int i = 0; i < parts; ++i) {
      const double moved = x(n + (i + 1.0) / parts) - x(n + static_cast<double>(i) / parts);
      energy += (wall.b * moved * parts / wall.T - tau) * moved;
    }
  }
  return energy;
}

}  // namespace

bool comes_to_rest(const SideLoop& loop, int ticks) {
  const auto law = law_of(loop);
  ExactAxis axis(loop.axis, loop.dt);
  law->reset(axis.x_, {});
  axis.v_ = 0.01;
  double middle = 0, end = 0;
  for (int n = 0; n < ticks; ++n) {
    law->observe(axis.x_);
    axis.advance(law->follow({}));
    if (!(std::abs(axis.v_) < 1e6)) return false;
    if (n >= ticks / 4) {
      double& most = n < ticks / 2 ? middle : end;
      most = std::max(most, std::abs(axis.v_));
    }
  }
  return end <= std::max(middle, 1e-9);  // below that is rounding
}

bool dies_out(const SampledWall& wall, double K) {
  constexpr int kTicks = 60'000;
  // Under a held torque v -> v_end + (v - v_end) e^{-t b/J}.
  const double decay = std::exp(-wall.T * wall.b / wall.J), lost = -std::expm1(-wall.T * wall.b / wall.J);
  double x = 1e-3, v = 0, x_before = x, middle = 0, end = 0;
  for (int n = 0; n < kTicks; ++n) {
    const double tau = -K * x - wall.B * (x - x_before) / wall.T;
    x_before = x;
    const double v_end = tau / wall.b, over = v - v_end;
    x += v_end * wall.T + over * lost * wall.J / wall.b;
    v = v_end + over * decay;
    if (std::abs(x) > 1e3) return false;
    double& most = n < kTicks / 2 ? middle : end;
    if (n >= kTicks / 4) most = std::max(most, std::abs(x));
  }
  return end < middle;
}

double least_energy(const SampledWall& wall, double K, Between between) {
  constexpr int kSamples = 100;
  double least = std::numeric_limits<double>::infinity();
  for (int periods = 1; periods <= kSamples / 2; ++periods)
    least = std::min(least, energy_put_in(wall, K, 2 * std::numbers::pi * periods / kSamples, kSamples, between));
  return least;
}

}  // namespace farhand
