#include "common/analysis/side_loop.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace farhand {
namespace {

double smoothing(double g, double dt) { return g * dt / (1.0 + g * dt); }

// With a = g dt/(1 + g dt) and everything multiplied by (z-1+a)(z-1+a_r)(z-1+a_v), the DOB turns
// tau = J_n a_ref + tau_dis into  A tau = -(V v + X x)  and v = a_v (z-1)/(dt (z-1+a_v)) x.
struct Law {
  Polynomial A;         // of the torque, with the factor (z-1+a_v)
  Polynomial feedback;  // of x
};

Law law(const SideLoop& loop) {
  const double a = smoothing(loop.g_dis, loop.dt), a_r = smoothing(loop.g_reac, loop.dt),
               a_v = smoothing(loop.g_v, loop.dt);
  const Polynomial z{0.0, 1.0}, z_1{-1.0, 1.0}, z_a{a - 1.0, 1.0}, z_r{a_r - 1.0, 1.0}, z_v{a_v - 1.0, 1.0};
  const double force = loop.J_n * loop.K_f;
  const Polynomial A = z_1 * z_r + force * a_r * z_a;
  const Polynomial V = loop.J_n * a / loop.dt * z_1 * z_r + loop.J_n * loop.K_d * z_a * z_r +
                       -force * a_r * z_a * (loop.viscous * z + loop.J_n / loop.dt * z_1);
  const Polynomial X = loop.J_n * loop.K_p * z_a * z_r;
  return {A * z_v, a_v / loop.dt * z_1 * V + z_v * X};
}

int neutral_roots(const SideLoop& loop) {
  if (loop.K_p != 0.0) return 0;
  if (loop.axis.k != 0.0) return loop.K_f == 0.0 ? 1 : 0;
  if (loop.K_d != 0.0) return 1;
  return loop.K_f == 0.0 || (loop.axis.b == 0.0 && loop.viscous == 0.0) ? 2 : 1;
}

}  // namespace

Polynomial characteristic(const SideLoop& loop) {
  const HeldAxis axis(loop.axis, loop.dt);
  const auto [A, feedback] = law(loop);
  Polynomial p = axis.denominator() * A + axis.numerator() * feedback;
  for (int i = neutral_roots(loop); i > 0; --i) p = without_root_at_one(p);
  return p;
}

double dob_limit(double inertia_ratio) {
  return inertia_ratio > 2.0 ? 2.0 / (inertia_ratio - 2.0) : std::numeric_limits<double>::infinity();
}

double encoder_noise(const SideLoop& loop, double counts_per_rev) {
  if (!(counts_per_rev > 0.0)) return 0.0;
  // tau = -feedback D_P / characteristic, of an error that is white and uniform over one count.
  const HeldAxis axis(loop.axis, loop.dt);
  const auto [A, feedback] = law(loop);
  Polynomial numerator = axis.denominator() * feedback;
  const Polynomial denominator = characteristic(loop);
  for (int i = neutral_roots(loop); i > 0; --i) numerator = without_root_at_one(numerator);
  numerator.resize(denominator.size(), 0.0);

  // Sum of the squares of the impulse response, until what is left cannot matter.
  const std::size_t n = denominator.size() - 1;
  std::vector<double> state(n + 1, 0.0);  // direct form II transposed
  double sum = 0.0;
  constexpr int kMost = 200'000;
  constexpr int kQuiet = 2'000;
  int quiet = 0;
  for (int i = 0; i < kMost && quiet < kQuiet; ++i) {
    const double in = i == 0 ? 1.0 : 0.0;
    const double out = (numerator[n] * in + state[0]) / denominator[n];
    for (std::size_t j = 0; j < n; ++j)
      state[j] = state[j + 1] + numerator[n - 1 - j] * in - denominator[n - 1 - j] * out;
    sum += out * out;
    quiet = out * out <= 1e-9 * sum ? quiet + 1 : 0;
  }
  const double count = 2.0 * std::numbers::pi / counts_per_rev;
  return count / std::sqrt(12.0) * std::sqrt(sum);
}

}  // namespace farhand
