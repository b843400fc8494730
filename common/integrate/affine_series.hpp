// The solution of an affine flow over a short time as a power series, and the time at which a guard falls on it. A
// bound of the series' curvature makes the search certain: an interval is excluded only if the guard provably does not
// fall in it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/integrate/affine.hpp"
#include "common/integrate/matrix_exponential.hpp"

namespace farhand {

// tau = s / length, from 0 to 1.
template <class T, std::size_t S>
class AffineSeries {
 public:
  using State = std::array<T, S>;

  // r counts from the start. Exact to rounding for length <= 1 / fastest, the fastest rate of A and of r.
  AffineSeries(const AffineFlow<T, S>& flow, const Forcing<T>& r, const State& x, T fastest, T length) noexcept
      : order_(taylor_order<T>(std::min(fastest * length, T(1)))) {
    T power = 1;
    for (std::size_t n = 0; n < 6; ++n, power *= length) r_[n] = r.polynomial[n] * power;
    if (r.sine != 0 || r.cosine != 0) {
      T sine = r.sine, cosine = r.cosine;  // the n-th coefficient is the derivative over n!
      for (std::size_t n = 0; n < order_; ++n) {
        r_[n] += cosine;
        const T turn = r.omega * length * kOneOver[n + 1], turned = sine * turn;
        sine = -cosine * turn, cosine = turned;
      }
    }
    terms_[0] = x;
    for (std::size_t i = 0; i < S; ++i) {
      const T sum = flow.b[i] + flow.e[i] * r_[0];
      T size = std::fabs(flow.b[i]) + std::fabs(flow.e[i] * r_[0]);
      for (std::size_t j = 0; j < S; ++j) size += std::fabs(flow.A[i][j] * x[j]);
      terms_[1][i] = length * (sum + dot(flow.A[i], x));
      size_[i] = std::fabs(x[i]) + length * size;
      way_[i] = std::fabs(terms_[1][i]);
    }
    for (std::size_t n = 1; n < order_; ++n) {
      const T scale = length * kOneOver[n + 1];
      unrolled<S>([&](auto i) {
        terms_[n + 1][i] = scale * (flow.e[i] * r_[n] + dot(flow.A[i], terms_[n]));
        way_[i] += std::fabs(terms_[n + 1][i]);
      });
    }
    for (std::size_t n = 1; n < order_; ++n) r_way_ += std::fabs(r_[n]);
    for (std::size_t i = 0; i < S; ++i) size_[i] += way_[i];
  }

  State at(T tau) const noexcept {
    State x = terms_[order_];
    for (std::size_t n = order_; n-- > 0;) {
      unrolled<S>([&](auto i) { x[i] = x[i] * tau + terms_[n][i]; });
    }
    return x;
  }

  // First tau at which the guard is below zero by more than its rounding; negative if there is none within 0..1.
  T first_fall(const AffineGuard<T, S>& guard) const noexcept {
    using Kind = typename AffineGuard<T, S>::Kind;
    if (guard.kind == Kind::kNever) return -1;
    const bool first_stays = stays(guard.first);
    if (first_stays && guard.kind != Kind::kMin) return -1;
    const bool second_stays = guard.kind != Kind::kOne && stays(guard.second);
    if (second_stays && (first_stays || guard.kind == Kind::kMax)) return -1;
    Pair g{polynomial(guard.first), {}, guard.kind};
    if (guard.kind != Kind::kOne) g.second = polynomial(guard.second);
    return g.first_fall();
  }

 private:
  static constexpr std::size_t kTerms = 29;
  static constexpr std::array<T, kTerms> kOneOver = [] {
    std::array<T, kTerms> all{};
    for (std::size_t n = 1; n < kTerms; ++n) all[n] = T(1) / static_cast<T>(n);
    return all;
  }();

  struct Range {
    T low, high, least_slope, most_slope;
  };
  struct Polynomial {
    std::array<T, kTerms> k{};
    std::size_t order = 0;
    T curvature = 0;  // bound of the second derivative

    void evaluate(T tau, T& value, T& slope) const noexcept {
      value = k[order], slope = 0;
      for (std::size_t n = order; n-- > 0;) slope = slope * tau + value, value = value * tau + k[n];
    }
    Range range(T middle, T half) const noexcept {
      T value, slope;
      evaluate(middle, value, slope);
      const T bend = curvature * half, reach = (std::fabs(slope) + bend / 2) * half;
      return {value - reach, value + reach, slope - bend, slope + bend};
    }
  };
  struct Pair {
    Polynomial first, second;
    typename AffineGuard<T, S>::Kind kind;
    using Kind = typename AffineGuard<T, S>::Kind;

    // Value and slope of the forms of the two that count.
    void evaluate(T tau, bool use_first, bool use_second, T& value, T& slope) const noexcept {
      (use_first ? first : second).evaluate(tau, value, slope);
      if (!use_first || !use_second) return;
      T other, other_slope;
      second.evaluate(tau, other, other_slope);
      if (kind == Kind::kMax ? other > value : other < value) value = other, slope = other_slope;
    }

    T first_fall() const noexcept {
      const T start = kind == Kind::kOne   ? first.k[0]
                      : kind == Kind::kMax ? std::max(first.k[0], second.k[0])
                                           : std::min(first.k[0], second.k[0]);
      if (start < 0) return 0;
      struct Interval {
        T from, to;
      };
      std::array<Interval, 80> open;
      std::size_t left = 0;
      open[left++] = {0, 1};
      for (int looked = 0; left > 0 && looked < 10000; ++looked) {
        const auto [from, to] = open[--left];
        const T half = (to - from) / 2, middle = from + half;
        const Range a = first.range(middle, half);
        const Range b = kind == Kind::kOne ? a : second.range(middle, half);
        // Finds which of the two forms decides. The larger of two never falls while one of them stays positive; a form
        // that is negative throughout does not count.
        bool use_a = true, use_b = kind != Kind::kOne;
        if (kind == Kind::kMax) {
          if (a.low >= 0 || b.low >= 0) continue;
          use_a = !(a.high < 0) || b.high < 0, use_b = !(b.high < 0);
        } else {
          use_a = !(a.low >= 0), use_b = use_b && !(b.low >= 0);
        }
        if (!use_a && !use_b) continue;
        const T least = std::min(use_a ? a.least_slope : b.least_slope, use_b ? b.least_slope : a.least_slope);
        const T most = std::max(use_a ? a.most_slope : b.most_slope, use_b ? b.most_slope : a.most_slope);
        if (least > 0) continue;  // rises, and was not down before
        if (most < 0 || half < std::numeric_limits<T>::epsilon()) {
          T value, slope;
          evaluate(to, use_a, use_b, value, slope);
          if (value < 0) return root(from, to, use_a, use_b);
          continue;
        }
        if (left + 2 > open.size()) break;
        open[left++] = {middle, to};
        open[left++] = {from, middle};
      }
      return -1;
    }

    // Root of a falling function: Newton's method, kept within the known bracket.
    T root(T from, T to, bool use_first, bool use_second) const noexcept {
      T tau = from + (to - from) / 2;
      for (int i = 0; i < 200; ++i) {
        T value, slope;
        evaluate(tau, use_first, use_second, value, slope);
        (value < 0 ? to : from) = tau;
        T next = tau - value / slope;
        if (!(next > from && next < to)) next = from + (to - from) / 2;
        if (std::fabs(next - tau) <= std::numeric_limits<T>::epsilon() * next) break;
        tau = next;
      }
      return tau;
    }
  };

  // True if the form stays positive even for the largest motion of state and forcing.
  bool stays(const AffineForm<T, S>& form) const noexcept {
    T left = form.value(terms_[0], r_[0]) - std::fabs(form.h) * r_way_;
    for (std::size_t i = 0; i < S; ++i) left -= std::fabs(form.c[i]) * way_[i];
    return left > 0;
  }

  // The form along the series, raised by its possible rounding error: a state that an event has left on a border must
  // not cause the event again.
  Polynomial polynomial(const AffineForm<T, S>& form) const noexcept {
    Polynomial p;
    T size = std::fabs(form.d) + std::fabs(form.h) * (std::fabs(r_[0]) + r_way_);
    for (std::size_t i = 0; i < S; ++i) size += std::fabs(form.c[i]) * size_[i];
    for (std::size_t n = 0; n <= order_; ++n) p.k[n] = form.h * r_[n] + dot(form.c, terms_[n]);
    for (std::size_t n = 2; n <= order_; ++n) p.curvature += static_cast<T>(n * (n - 1)) * std::fabs(p.k[n]);
    const T rounding = 4 * std::numeric_limits<T>::epsilon() * size;
    p.k[0] += form.d + rounding;
    p.order = order_;
    while (p.order > 1 && std::fabs(p.k[p.order]) < rounding / 1024) --p.order;
    return p;
  }

  std::size_t order_;
  std::array<T, kTerms> r_{};
  std::array<State, kTerms> terms_{};
  State way_{}, size_{};  // sums of moduli: of the motion, and of all terms
  T r_way_ = 0;
};

}  // namespace farhand
