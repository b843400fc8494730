// A plant that is affine in its state while a mode holds: x' = A x + b + e r(t), with r a quintic plus one sine, which
// is what the intended movements are made of, and with guards made of affine functions. Such a plant can be propagated
// without any step error (closed_form.hpp). Everything is asked for in the scalar type of the propagator, so that the
// same plant also yields the reference in long double.
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

// body(0), body(1) ... body(N - 1) without a loop: at -O2 the compiler keeps a loop, and a state in memory for it,
// where N is 2.
template <std::size_t N, class Body>
constexpr void unrolled(Body&& body) noexcept {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (body(std::integral_constant<std::size_t, i>{}), ...); }
  (std::make_index_sequence<N>{});
}

template <class T, std::size_t S>
struct AffineFlow {
  std::array<std::array<T, S>, S> A{};  // row by row
  std::array<T, S> b{};                 // everything that is constant between two ticks, the held input included
  std::array<T, S> e{};                 // how the forcing acts
};

// r(t), valid until the plant's next_break.
template <class T>
struct Forcing {
  T begin = 0;                    // s; the rest counts from here
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
  // The same function, counted from s later.
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

// At least zero while the mode holds. One form is enough for a contact that pushes; an open contact of spring and
// damper closes only once penetration and push are both positive, so it needs the larger of two; a joint that sticks
// lets go to either side, so it needs the smaller. kNever: cannot fall (the wall that a scene does not have).
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

// `guard_forms` says as forms what `guards` says as values. Within a mode, A, e and the slopes of the guards (kind, c,
// h) never change; b and d may follow the held input. A plant in whose guards it is never found says so with
// `static constexpr bool kInputMovesGuards = false`, and its guards are then asked for once per mode. One that has
// `held()`, the input, and `held_gain<T>(mode)`, by which b follows it, is asked for its flow once per mode, too.
template <class P>
concept AffinePlant = Plant<P> && requires(const P& plant, Mode mode, double t) {
  // nullptr, or in words why this plant is not piecewise affine.
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
