// A plant that is affine in its state within a mode: x' = A x + b + e r(t). r is a quintic plus one sine, of which the
// intended movements consist, and the guards are made of affine functions. Such a plant can be propagated without any
// step error (closed_form.hpp). The scalar type is that of the propagator, so that the same plant also gives the
// reference in long double.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

#include "common/integrate/plant.hpp"

namespace farhand {

// body(0), body(1) ... body(N - 1) without a loop: at -O2 the compiler keeps a loop even for N = 2, and with it the
// state in memory.
template <std::size_t N, class Body>
constexpr void unrolled(Body&& body) noexcept {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (body(std::integral_constant<std::size_t, i>{}), ...); }
  (std::make_index_sequence<N>{});
}

template <class T, std::size_t S>
struct AffineFlow {
  std::array<std::array<T, S>, S> A{};  // row by row
  std::array<T, S> b{};                 // all that is constant between two ticks, the held input included
  std::array<T, S> e{};                 // effect of the forcing
};

// r(t), valid until the plant's next_break.
template <class T>
struct Forcing {
  T begin = 0;                    // s, origin of time for the coefficients
  std::array<T, 6> polynomial{};  // coefficient of s^j
  T omega = 0;                    // rad/s
  T sine = 0, cosine = 0;

  T at(T t) const noexcept {
    const T s = t - begin;
    T r = polynomial[5];
    for (std::size_t j = 5; j-- > 0;) r = r * s + polynomial[j];
    if (sine == 0 && cosine == 0) return r;
    return r + sine * std::sin(omega * s) + cosine * std::cos(omega * s);
  }
  // The same function with its origin of time moved by s.
  Forcing later(T s) const noexcept {
    Forcing r{begin + s, polynomial, omega, 0, 0};
    unrolled<5>([&](auto from) {  // by synthetic division
      unrolled<5 - from>([&](auto i) { r.polynomial[4 - i] += s * r.polynomial[5 - i]; });
    });
    if (sine != 0 || cosine != 0) {
      const T sin_s = std::sin(omega * s), cos_s = std::cos(omega * s);
      r.sine = sine * cos_s - cosine * sin_s;
      r.cosine = cosine * cos_s + sine * sin_s;
    }
    return r;
  }
  bool constant() const noexcept {
    for (std::size_t j = 1; j < 6; ++j) {
      if (polynomial[j] != 0) return false;
    }
    return sine == 0 && cosine == 0;
  }
};

template <class T, std::size_t S>
struct AffineForm {
  std::array<T, S> c{};  // c . x + d + h r(t)
  T d = 0;
  T h = 0;

  T value(const std::array<T, S>& x, T r) const noexcept {
    T sum = d + h * r;
    for (std::size_t i = 0; i < S; ++i) sum += c[i] * x[i];
    return sum;
  }
};

// At least zero within the mode. One form suffices for a contact that pushes. An open contact of spring and damper
// closes only when penetration and push are both positive; its guard therefore needs the larger of two forms. A joint
// that sticks can break away to either side; its guard needs the smaller of two forms. kNever: cannot fall (the wall
// that a scene does not have).
template <class T, std::size_t S>
struct AffineGuard {
  enum class Kind { kNever, kOne, kMin, kMax };
  Kind kind = Kind::kNever;
  AffineForm<T, S> first{}, second{};

  T value(const std::array<T, S>& x, T r) const noexcept {
    switch (kind) {
      case Kind::kOne:
        return first.value(x, r);
      case Kind::kMin:
        return std::min(first.value(x, r), second.value(x, r));
      case Kind::kMax:
        return std::max(first.value(x, r), second.value(x, r));
      case Kind::kNever:
        break;
    }
    return std::numeric_limits<T>::infinity();
  }
};

// `guard_forms` gives as forms the guards that `guards` gives as values. Within a mode A, e and the slopes of the
// guards (kind, c, h) never change; b and d may depend on the held input. A plant whose guards do not depend on the
// input declares `static constexpr bool kInputMovesGuards = false`; its guards are then evaluated once per mode. A
// plant with `held()`, the input, and `held_gain<T>(mode)`, the derivative of b by the input, has its flow evaluated
// once per mode, too.
template <class P>
concept AffinePlant = Plant<P> && requires(const P& plant, Mode mode, double t) {
  // nullptr, or the reason, as text, why this plant is not piecewise affine.
  { plant.not_affine() }
  noexcept->std::same_as<const char*>;
  { plant.template flow<double>(mode) }
  noexcept->std::same_as<AffineFlow<double, P::kStates>>;
  { plant.template flow<long double>(mode) }
  noexcept->std::same_as<AffineFlow<long double, P::kStates>>;
  { plant.template forcing<double>(t) }
  noexcept->std::same_as<Forcing<double>>;
  { plant.template guard_forms<double>(mode) }
  noexcept->std::same_as<std::array<AffineGuard<double, P::kStates>, P::kGuards>>;
  { plant.template guard_forms<long double>(mode) }
  noexcept->std::same_as<std::array<AffineGuard<long double, P::kStates>, P::kGuards>>;
};

}  // namespace farhand
