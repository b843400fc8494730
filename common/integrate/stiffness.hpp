// The fastest rate of a plant, and the method chosen by it: the closed form if the plant is affine, an implicit method
// if a step of RK4 would be unstable, else RK4.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>

#include "common/integrate/eigenvalues.hpp"
#include "common/integrate/method.hpp"
#include "common/integrate/plant.hpp"
#include "common/integrate/rk4.hpp"

namespace farhand {

template <Plant P>
std::complex<double> fastest_eigenvalue(const P& plant, Mode mode, double t, const typename P::State& x) {
  const auto J = plant.jacobian(mode, t, x);
  std::array<double, P::kStates * P::kStates> row_by_row;
  for (std::size_t i = 0; i < row_by_row.size(); ++i) row_by_row[i] = J[i / P::kStates][i % P::kStates];
  return fastest_eigenvalue(row_by_row, P::kStates);
}

// The reasons for a choice of method.
struct MethodChoice {
  Method method = Method::kRk4;
  const char* not_affine = "";          // why it is not the closed form; nullptr if it is
  std::complex<double> eigenvalue = 0;  // of largest modulus, 1/s
  Mode mode = 0;                        // where it was found
  double rate_times_step = 0;           // its modulus times the step
  double limit = kRk4StableRadius;      // of that, for RK4
};

// States at which a plant is examined: stiffness depends on the closed contacts and, with bristles, on the speed.
template <Plant P>
struct Situation {
  Mode mode = 0;
  double t = 0;
  typename P::State x{};
};

template <Plant P>
MethodChoice choose(const P& plant, double step, std::span<const Situation<P>> situations) {
  MethodChoice choice;
  for (const auto& s : situations) {
    const auto eigenvalue = fastest_eigenvalue(plant, s.mode, s.t, s.x);
    if (!(std::abs(eigenvalue) > std::abs(choice.eigenvalue))) continue;
    choice.eigenvalue = eigenvalue;
    choice.mode = s.mode;
  }
  choice.rate_times_step = std::abs(choice.eigenvalue) * step;
  if constexpr (requires { plant.not_affine(); })
    choice.not_affine = plant.not_affine();
  else
    choice.not_affine = "the plant has no affine form";
  if (choice.not_affine == nullptr)
    choice.method = Method::kClosedForm;
  else if (choice.rate_times_step > choice.limit)
    choice.method = Method::kSdirk2;
  return choice;
}

}  // namespace farhand
