// Propagation of an affine flow x' = A x + b + e r(t) over a fixed time, for every b and every forcing at once: the
// matrix exponential of the augmented system, block by block. It is a Taylor series for a short time, which is doubled
// until the time is reached. The doubling uses Phi - I and not Phi: squaring Phi would lose the slow motions of a stiff
// plant in the rounding of the ones on its diagonal. Instances in double are computed in long double, so that they add
// no error but their final rounding.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

#include "common/integrate/affine.hpp"

namespace farhand {

template <class T>
using Wide = std::conditional_t<(sizeof(T) < sizeof(long double)), long double, T>;

template <class T, std::size_t S>
using SquareMatrix = std::array<std::array<T, S>, S>;

// Even and odd terms apart: the sum is on the way from one tick to the next.
template <class T, std::size_t S>
T dot(const std::array<T, S>& a, const std::array<T, S>& b) noexcept {
  std::array<T, 2> sum{a[0] * b[0], S > 1 ? a[S > 1] * b[S > 1] : T(0)};
  unrolled<S>([&](auto i) {
    if constexpr (i > 1) sum[i % 2] += a[i] * b[i];
  });
  return sum[0] + sum[1];
}

template <class T, std::size_t S>
std::array<T, S> times(const SquareMatrix<T, S>& A, const std::array<T, S>& x) noexcept {
  std::array<T, S> y{};
  for (std::size_t i = 0; i < S; ++i) {
    for (std::size_t j = 0; j < S; ++j) y[i] += A[i][j] * x[j];
  }
  return y;
}

template <class T, std::size_t S>
SquareMatrix<T, S> times(const SquareMatrix<T, S>& A, const SquareMatrix<T, S>& B) noexcept {
  SquareMatrix<T, S> C{};
  for (std::size_t i = 0; i < S; ++i) {
    for (std::size_t k = 0; k < S; ++k) {
      for (std::size_t j = 0; j < S; ++j) C[i][j] += A[i][k] * B[k][j];
    }
  }
  return C;
}

// A with units of the state that make its row-sum norm small. With rad and rad/s a wall would enter with the square of
// its frequency.
template <class T, std::size_t S>
struct Balanced {
  T rate = 0;    // that norm: no motion of x' = A x is faster, 1/s
  T growth = 0;  // in those units, the state's length grows no faster; 0 for a mass on springs and dampers
  std::array<T, S> units{};
};

template <class T, std::size_t S>
Balanced<T, S> balance(const SquareMatrix<T, S>& A) noexcept {
  SquareMatrix<T, S> m = A;
  Balanced<T, S> out;
  out.units.fill(1);
  for (int sweep = 0; sweep < 8; ++sweep) {
    for (std::size_t i = 0; i < S; ++i) {
      T row = 0, column = 0;
      for (std::size_t j = 0; j < S; ++j) {
        if (j != i) row += std::fabs(m[i][j]), column += std::fabs(m[j][i]);
      }
      if (!(row > 0 && column > 0)) continue;
      const T unit = std::sqrt(row / column);
      for (std::size_t j = 0; j < S; ++j) {
        if (j != i) m[i][j] /= unit, m[j][i] *= unit;
      }
      out.units[i] *= unit;
    }
  }
  for (std::size_t i = 0; i < S; ++i) {
    T sum = std::fabs(m[i][i]), growth = m[i][i];
    for (std::size_t j = 0; j < S; ++j) {
      if (j != i) sum += std::fabs(m[i][j]), growth += std::fabs(m[i][j] + m[j][i]) / 2;
    }
    if (!(sum <= out.rate)) out.rate = sum;  // keeps NaN
    out.growth = std::max(out.growth, growth);
  }
  return out;
}

template <class T, std::size_t S>
T fastest_rate_of(const SquareMatrix<T, S>& A) noexcept {
  return balance(A).rate;
}

// y with y A = c; NaN if there is none.
template <class T, std::size_t S>
std::array<T, S> solve_row(const SquareMatrix<T, S>& A, const std::array<T, S>& c) noexcept {
  SquareMatrix<T, S> m{};  // transposed
  std::array<T, S> y = c;
  for (std::size_t i = 0; i < S; ++i) {
    for (std::size_t j = 0; j < S; ++j) m[i][j] = A[j][i];
  }
  for (std::size_t k = 0; k < S; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < S; ++i) {
      if (std::fabs(m[i][k]) > std::fabs(m[pivot][k])) pivot = i;
    }
    std::swap(m[k], m[pivot]);
    std::swap(y[k], y[pivot]);
    for (std::size_t i = k + 1; i < S; ++i) {
      const T factor = m[i][k] / m[k][k];
      for (std::size_t j = k; j < S; ++j) m[i][j] -= factor * m[k][j];
      y[i] -= factor * y[k];
    }
  }
  for (std::size_t k = S; k-- > 0;) {
    for (std::size_t j = k + 1; j < S; ++j) y[k] -= m[k][j] * y[j];
    y[k] /= m[k][k];
  }
  return y;
}

// Terms after which a Taylor series of exp(x), 0 <= x <= 1, changes nothing any more. The forcing has degree 5.
template <class T>
std::size_t taylor_order(T x) noexcept {
  T term = 1;
  std::size_t n = 0;
  while (n < 7 || (term > std::numeric_limits<T>::epsilon() / 8 && n < 28)) term *= x / static_cast<T>(++n);
  return n;
}

// Phi(s) = exp(A s), Psi(s) = its integral from 0 to s. With z = A x + b + e r(0), the state's slope at the start,
//   x(s) = x + Psi z + sum_j power[j-1] p_j + sine S + cosine C
// for r = p_0 + sum_j p_j s^j + S sin(omega s) + C cos(omega s).
template <class T, std::size_t S, std::size_t R = 0>
struct AffineResponse {
  T length = 0;
  SquareMatrix<T, S> D{};  // Phi - I
  SquareMatrix<T, S> Psi{};
  std::array<std::array<T, S>, 5> power{};  // to s, s^2 ... s^5
  std::array<T, S> sine{}, cosine{};        // to sin(omega s) and cos(omega s) - 1
  T sine_end = 0, cosine_end = 0;           // what these two are at the end

  // For rows c that multiply the state: bounds of |c Psi(s)|, entry by entry, for all s from 0 to length.
  std::array<std::array<T, S>, R> reach{};
};

// Everything is NaN if the fastest rate times the length is beyond 2^100 or not a number.
template <class T, std::size_t S, std::size_t R = 0>
AffineResponse<T, S, R> respond(const SquareMatrix<T, S>& A, const std::array<T, S>& e, T omega, T length,
                                const std::array<std::array<T, S>, R>& rows = {}) noexcept {
  using Vector = std::array<T, S>;
  AffineResponse<T, S, R> out;
  out.length = length;
  const Balanced<T, S> balanced = balance(A);
  const T fastest = std::max(balanced.rate, std::fabs(omega));
  int doublings = 0;
  T h = length;
  for (; doublings < 101 && fastest * h > T(0.5); ++doublings) h /= 2;
  if (!(fastest * h <= T(0.5))) {
    for (auto& row : out.Psi) row.fill(std::numeric_limits<T>::quiet_NaN());
    for (auto& row : out.reach) row.fill(std::numeric_limits<T>::quiet_NaN());
    out.D = out.Psi;
    return out;
  }
  const std::size_t order = taylor_order<T>(T(0.5));

  SquareMatrix<T, S> B = A;
  for (auto& row : B) {
    for (T& entry : row) entry *= h;
  }
  // Psi = h (I + B/2 (I + B/3 (...)))
  for (std::size_t i = 0; i < S; ++i) out.Psi[i][i] = 1;
  for (std::size_t n = order; n >= 2; --n) {
    out.Psi = times(B, out.Psi);
    for (std::size_t i = 0; i < S; ++i) {
      for (std::size_t j = 0; j < S; ++j) out.Psi[i][j] = out.Psi[i][j] / static_cast<T>(n) + (i == j ? T(1) : T(0));
    }
  }
  for (auto& row : out.Psi) {
    for (T& entry : row) entry *= h;
  }
  out.D = times(A, out.Psi);
  // c Psi is the sum of c B^n h/(n+1)!, and every term grows with s.
  for (std::size_t r = 0; r < R; ++r) {
    Vector term = rows[r];
    for (T& entry : term) entry *= h;
    for (std::size_t n = 1; n <= order + 1; ++n) {
      Vector next{};
      for (std::size_t j = 0; j < S; ++j) {
        out.reach[r][j] += std::fabs(term[j]);
        for (std::size_t i = 0; i < S; ++i) next[j] += term[i] * B[i][j] / static_cast<T>(n + 1);
      }
      term = next;
    }
  }
  // The response to s^j: h^(j+1)/(j+1) (I + B/(j+2) (I + B/(j+3) (...))) e
  bool forced = false;
  for (const T entry : e) forced = forced || entry != 0;
  if (forced) {
    T scale = h;
    for (std::size_t j = 1; j <= 5; ++j) {
      scale *= h;
      Vector sum = e;
      for (std::size_t n = j + order; n >= j + 2; --n) {
        sum = times(B, sum);
        for (std::size_t i = 0; i < S; ++i) sum[i] = e[i] + sum[i] / static_cast<T>(n);
      }
      for (std::size_t i = 0; i < S; ++i) out.power[j - 1][i] = sum[i] * scale / static_cast<T>(j + 1);
    }
    if (omega != 0) {
      const T half = std::sin(omega * length / 2);
      out.sine_end = std::sin(omega * length), out.cosine_end = -2 * half * half;
      // x_(n+1) = (B x_n + h e r_n)/(n+1), with r_n of sin and of cos - 1 in units of h
      Vector s{}, c{};
      T sin_n = 0, cos_n = 1;  // Taylor coefficients of sin and cos
      const T theta = omega * h;
      for (std::size_t n = 0; n <= order; ++n) {
        s = times(B, s), c = times(B, c);
        const T next = T(1) / static_cast<T>(n + 1);
        for (std::size_t i = 0; i < S; ++i) {
          s[i] = (s[i] + h * e[i] * sin_n) * next;
          c[i] = (c[i] + h * e[i] * (n == 0 ? T(0) : cos_n)) * next;
          out.sine[i] += s[i], out.cosine[i] += c[i];
        }
        const T rising = cos_n * theta * next;
        cos_n = -sin_n * theta * next;
        sin_n = rising;
      }
    }
  }

  for (int doubling = 0; doubling < doublings; ++doubling, h *= 2) {
    for (std::size_t r = 0; r < R; ++r) {  // c Psi(s + h) = c Psi(h) + c Psi(s) Phi(h)
      Vector there{}, further{};
      for (std::size_t i = 0; i < S; ++i) {
        for (std::size_t j = 0; j < S; ++j) {
          there[j] += rows[r][i] * out.Psi[i][j];
          further[j] += out.reach[r][i] * std::fabs(out.D[i][j] + (i == j ? T(1) : T(0)));
        }
      }
      for (std::size_t j = 0; j < S; ++j) out.reach[r][j] = std::max(out.reach[r][j], std::fabs(there[j]) + further[j]);
    }
    if (forced) {
      // Over the second half the forcing is (h + s)^j, sin(omega h + omega s) ...: sums of the responses to the first.
      const Vector constant = times(out.Psi, e);
      if (omega != 0) {
        const T sin_h = std::sin(omega * h), cos_h = std::cos(omega * h), half = std::sin(omega * h / 2);
        const Vector s = times(out.D, out.sine), c = times(out.D, out.cosine);
        for (std::size_t i = 0; i < S; ++i) {
          const T sine = out.sine[i], cosine = out.cosine[i];
          out.sine[i] = sine + s[i] + cos_h * sine + sin_h * (cosine + constant[i]);
          out.cosine[i] = cosine + c[i] + cos_h * cosine - 2 * half * half * constant[i] - sin_h * sine;
        }
      }
      for (std::size_t j = 5; j >= 1; --j) {
        const Vector first = times(out.D, out.power[j - 1]);
        Vector sum = constant;
        T binomial = 1;
        for (std::size_t i = 0; i < S; ++i) sum[i] *= h;
        for (std::size_t m = 1; m <= j; ++m) {
          binomial *= static_cast<T>(j - m + 1) / static_cast<T>(m);
          for (std::size_t i = 0; i < S; ++i) {
            sum[i] += binomial * out.power[m - 1][i];
            if (m < j) sum[i] *= h;
          }
        }
        for (std::size_t i = 0; i < S; ++i) out.power[j - 1][i] += first[i] + sum[i];
      }
    }
    const SquareMatrix<T, S> D2 = times(out.D, out.D), further_Psi = times(out.D, out.Psi);
    for (std::size_t i = 0; i < S; ++i) {
      for (std::size_t j = 0; j < S; ++j) {
        out.D[i][j] += out.D[i][j] + D2[i][j];
        out.Psi[i][j] += out.Psi[i][j] + further_Psi[i][j];
      }
    }
  }
  // Each doubling may count an undamped motion again, although it only repeats. If the state's length cannot grow,
  // c Psi = y (Phi - I) with y A = c is a bound for all times.
  if (balanced.growth * length < T(1e-6)) {
    for (std::size_t r = 0; r < R; ++r) {
      const Vector y = solve_row(A, rows[r]);
      T size = 0;
      for (std::size_t i = 0; i < S; ++i) size += y[i] * y[i] * balanced.units[i] * balanced.units[i];
      for (std::size_t j = 0; j < S; ++j) {
        const T bound = (std::sqrt(size) / balanced.units[j] + std::fabs(y[j])) * T(1.000002);
        if (bound < out.reach[r][j]) out.reach[r][j] = bound;
      }
    }
  }
  return out;
}

}  // namespace farhand
