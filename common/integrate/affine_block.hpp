// The propagation of a piecewise affine plant over one length of time in one mode, computed once and applied each time
// that this length recurs; and the proof that no guard falls on the way.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

#include "common/integrate/affine.hpp"
#include "common/integrate/matrix_exponential.hpp"

namespace farhand {

// The parts of a tick are always inlined: states of two numbers that are passed in memory would take twice the time.
template <class T, std::size_t S>
[[gnu::always_inline]] inline std::array<T, S> slope(const SquareMatrix<T, S>& A, const std::array<T, S>& b,
                                                     const std::array<T, S>& e, T r,
                                                     const std::array<T, S>& x) noexcept {
  std::array<T, S> z;
  unrolled<S>([&](auto i) { z[i] = (b[i] + e[i] * r) + dot(A[i], x); });
  return z;
}
// Effect of the forcing over a length from its start: the change of the state, the change of r from start to end, and
// the total distance that r moves, up and down.
template <class T, std::size_t S>
struct Push {
  std::array<T, S> state{};
  T change = 0, swing = 0;
};
template <class T, std::size_t S>
Push<T, S> push(const AffineResponse<T, S>& response, const Forcing<T>& r) noexcept {
  Push<T, S> out;
  T power = 1;
  unrolled<5>([&](auto j) {
    power *= response.length;
    out.change += r.polynomial[j + 1] * power;
    out.swing += std::fabs(r.polynomial[j + 1]) * power;
    unrolled<S>([&](auto i) { out.state[i] += response.power[j][i] * r.polynomial[j + 1]; });
  });
  if (r.sine != 0 || r.cosine != 0) {
    out.change += response.sine_end * r.sine + response.cosine_end * r.cosine;
    out.swing += std::fabs(r.omega) * response.length * (std::fabs(r.sine) + std::fabs(r.cosine));
    for (std::size_t i = 0; i < S; ++i) out.state[i] += response.sine[i] * r.sine + response.cosine[i] * r.cosine;
  }
  return out;
}
// Propagation of an unforced state over length + late, with `late` to first order only. A forced state adds late_push.
template <class T, std::size_t S>
[[gnu::always_inline]] inline std::array<T, S> change(const AffineResponse<T, S>& response, const std::array<T, S>& z,
                                                      T late) noexcept {
  std::array<T, S> y;
  unrolled<S>([&](auto i) {
    std::array<T, S> row;  // Psi + late Phi
    unrolled<S>(
        [&](auto j) { row[j] = response.Psi[i][j] + late * (i == j ? response.D[i][j] + T(1) : response.D[i][j]); });
    y[i] = dot(row, z);
  });
  return y;
}
// At the end of the length the slope of a forced state is Phi z + A (the change by the push) + e (the change of r): the
// last two terms more than for an unforced state. Without them their work would be missing from the energy at every
// late tick, and in the same direction for hours, because the lengths of ticks far from 0 s are rounded to a lattice
// (LongRun.ClockThatIsLateMakesNoEnergy).
template <class T, std::size_t S>
std::array<T, S> late_push(const SquareMatrix<T, S>& A, const std::array<T, S>& e, const Push<T, S>& pushed,
                           T late) noexcept {
  std::array<T, S> y;
  unrolled<S>([&](auto i) { y[i] = late * (dot(A[i], pushed.state) + e[i] * pushed.change); });
  return y;
}
template <class T, std::size_t S>
[[gnu::always_inline]] inline std::array<T, S> sum(const std::array<T, S>& a, const std::array<T, S>& b) noexcept {
  std::array<T, S> y;
  unrolled<S>([&](auto i) { y[i] = a[i] + b[i]; });
  return y;
}

template <AffinePlant P, class T>
struct AffineBlock {
  static constexpr std::size_t kStates = P::kStates, kGuards = P::kGuards;
  using State = std::array<T, kStates>;
  using Form = AffineForm<T, kStates>;
  using Guards = std::array<AffineGuard<T, kStates>, kGuards>;
  static constexpr bool kGuardsAreFixed = requires { requires !P::kInputMovesGuards; };
  static constexpr bool kGivesGain = requires(const P& plant, Mode mode) {
    { plant.held() } -> std::convertible_to<double>;
    { plant.template held_gain<T>(mode) } -> std::same_as<State>;
  };

  // Bound of the change of a form within a block: reach |x'| + drift * (total distance that r moves).
  struct Bound {
    State reach{};
    T drift = 0;
  };
  // Length and mode of a block. The length may differ by `slack`; negative: unused.
  struct Key {
    Mode mode = 0;
    T omega = 0, length = 0, slack = -1;
  };

  SquareMatrix<T, kStates> A{};
  State e{};
  State b{}, gain{};  // b without input, and what the input adds
  AffineResponse<T, kStates> response{};
  Guards guards{};
  std::array<std::array<Bound, 2>, kGuards> bounds{};
  bool simple = false;  // no guard follows input or forcing directly, and each stays up if its first form does
  // The lowest of the first forms that move alike, such as the gaps to all contacts on one side: it falls first.
  struct Lowest {
    State c{};
    T d = 1;
    Bound bound{};
  };
  static constexpr std::size_t kUsual = std::min<std::size_t>(kGuards, 2);  // both sides of one axis
  std::array<Lowest, kGuards> lowest{};
  std::size_t kinds = 0;

  Key fill(const P& plant, Mode mode, T omega, T length) noexcept;

  [[gnu::always_inline]] State slope(const State& offset_now, T r, const State& x) const noexcept {
    return farhand::slope(A, offset_now, e, r, x);
  }
  // b under the input that the plant holds now.
  [[gnu::always_inline]] State offset(const P& plant, Mode mode) const noexcept {
    if constexpr (kGivesGain) {
      const T input = static_cast<T>(plant.held());
      State now;
      unrolled<kStates>([&](auto i) { now[i] = b[i] + gain[i] * input; });
      return now;
    } else {
      return plant.template flow<T>(mode).b;
    }
  }

  decltype(auto) guards_now(const P& plant, Mode mode) const noexcept {
    if constexpr (kGuardsAreFixed) {
      return (guards);
    } else {
      return plant.template guard_forms<T>(mode);
    }
  }

  // Lower bound of a form within a block, less the possible rounding loss. NaN if any number is NaN.
  static T left_of(const Form& form, const Bound& bound, const State& x, const State& z, T r, T swing) noexcept {
    State modulus;
    unrolled<kStates>([&](auto i) { modulus[i] = std::fabs(z[i]); });
    const T left = (form.d + dot(form.c, x)) - dot(bound.reach, modulus);
    return bound.drift == 0 ? left : left + (form.h * r - bound.drift * swing);
  }
  // True if no guard can fall in this block. With kLenient: by more than rounding, so that a state may rest on a
  // border.
  template <bool kLenient>
  [[gnu::noinline]] bool clear(const Guards& now, const State& x, const State& z, T r, T swing) const noexcept {
    using Kind = typename AffineGuard<T, kStates>::Kind;
    const auto stays = [&](const Form& form, const Bound& bound) {
      T left = left_of(form, bound, x, z, r, swing);
      if constexpr (kLenient) {
        T size = std::fabs(form.d) + std::fabs(form.h * r);
        for (std::size_t i = 0; i < kStates; ++i) size += std::fabs(form.c[i] * x[i]);
        left += std::numeric_limits<T>::epsilon() * size;
      }
      return left > 0;
    };
    for (std::size_t i = 0; i < kGuards; ++i) {
      const auto& guard = now[i];
      const auto& bound = bounds[i];
      const bool first = guard.kind == Kind::kNever || stays(guard.first, bound[0]);
      const bool both = guard.kind == Kind::kMin, either = guard.kind == Kind::kMax;
      if ((first && !both) || ((first || either) && stays(guard.second, bound[1]))) continue;
      return false;
    }
    return true;
  }

  // The usual case: all guards are far, and their first forms suffice to show it.
  [[gnu::always_inline]] bool clear_at_once(const State& x, const State& z, T swing) const noexcept {
    bool all = simple;
    State modulus;
    unrolled<kStates>([&](auto i) { modulus[i] = std::fabs(z[i]); });
    const auto far = [&](const Lowest& form) __attribute__((always_inline)) {
      return (form.d + dot(form.c, x)) - (dot(form.bound.reach, modulus) + form.bound.drift * swing) > 0;
    };
    if constexpr (kGuards > 0) all &= far(lowest[0]);
    if constexpr (kGuards > 1) all &= far(lowest[1]);
    for (std::size_t i = kUsual; i < kinds; ++i) all &= far(lowest[i]);
    return all;
  }
};

template <AffinePlant P, class T>
typename AffineBlock<P, T>::Key AffineBlock<P, T>::fill(const P& plant, Mode mode, T omega, T length) noexcept {
  using W = Wide<T>;
  const AffineFlow<W, kStates> flow = plant.template flow<W>(mode);
  const W rate = fastest_rate_of(flow.A);
  std::array<std::array<W, kStates>, 2 * kGuards> rows{};
  const auto forms = plant.template guard_forms<W>(mode);
  for (std::size_t g = 0; g < kGuards; ++g) rows[2 * g] = forms[g].first.c, rows[2 * g + 1] = forms[g].second.c;
  const auto wide = respond(flow.A, flow.e, static_cast<W>(omega), static_cast<W>(length), rows);
  guards = plant.template guard_forms<T>(mode);
  response.length = length;
  // `late` is of first order: its square must be negligible.
  const T fastest = std::max(static_cast<T>(rate), std::fabs(omega));
  const Key key{mode, omega, length,
                std::min(T(1e-6) * length, std::sqrt(std::numeric_limits<T>::epsilon()) / 8 / fastest)};
  const auto narrow = [](const std::array<W, kStates>& from, State& to) {
    for (std::size_t i = 0; i < kStates; ++i) to[i] = static_cast<T>(from[i]);
  };
  for (std::size_t i = 0; i < kStates; ++i) {
    narrow(flow.A[i], A[i]);
    narrow(wide.D[i], response.D[i]);
    narrow(wide.Psi[i], response.Psi[i]);
  }
  for (std::size_t j = 0; j < 5; ++j) narrow(wide.power[j], response.power[j]);
  response.sine_end = static_cast<T>(wide.sine_end), response.cosine_end = static_cast<T>(wide.cosine_end);
  narrow(wide.sine, response.sine);
  narrow(wide.cosine, response.cosine);
  narrow(flow.e, e);
  if constexpr (kGivesGain) {
    gain = plant.template held_gain<T>(mode);
    const std::array<W, kStates> wide_gain = plant.template held_gain<W>(mode);
    for (std::size_t i = 0; i < kStates; ++i)
      b[i] = static_cast<T>(flow.b[i] - wide_gain[i] * static_cast<W>(plant.held()));
  }
  simple = kGuardsAreFixed;
  for (const auto& guard : guards) {
    simple = simple && guard.kind != AffineGuard<T, kStates>::Kind::kMin && guard.first.h == 0;
  }
  // A millionth more covers their rounding and the lateness of the block.
  for (std::size_t g = 0; g < kGuards; ++g) {
    for (const bool second : {false, true}) {
      const auto& form = second ? forms[g].second : forms[g].first;
      Bound& bound = bounds[g][second];
      W drift = std::fabs(form.h);
      for (std::size_t j = 0; j < kStates; ++j) {
        drift += wide.reach[2 * g + second][j] * std::fabs(flow.e[j]);
        bound.reach[j] = static_cast<T>(wide.reach[2 * g + second][j] * W(1.000001));
      }
      bound.drift = static_cast<T>(drift * W(1.000001));
    }
  }
  lowest = {}, kinds = 0;
  for (std::size_t g = 0; g < kGuards; ++g) {
    const Form& form = guards[g].first;
    if (guards[g].kind == AffineGuard<T, kStates>::Kind::kNever) continue;
    std::size_t i = 0;
    while (i < kinds && lowest[i].c != form.c) ++i;
    if (i == kinds || form.d < lowest[i].d) lowest[i] = {form.c, form.d, bounds[g][0]};
    kinds = std::max(kinds, i + 1);
  }
  return key;
}

}  // namespace farhand
