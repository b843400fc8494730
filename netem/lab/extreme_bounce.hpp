// The second computation for plants: written from the physics, in long double, without any code of the product.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "common/plant/axis_plant.hpp"

namespace farhand::extreme {

// A mass between one-sided springs: J x'' = tau - D x' - sum of pushes, push = side max(0, k p + b p'), p = side (x -
// at) > 0. Each stretch in closed form, its ends by bisection.
class Bounce {
 public:
  struct Contact {
    long double k, b, at, side;
    bool pushing = false;
  };
  Bounce(double J, double D, std::vector<Contact> contacts, double x, double v);

  void advance(double torque, double seconds);
  double x() const { return static_cast<double>(x_); }
  double v() const { return static_cast<double>(v_); }
  int events() const { return events_; }

 private:
  struct Point {
    long double x, v;
  };
  Point after(long double h) const;  // from here, in the present contacts
  static bool changes(const Contact& contact, const Point& point);
  int first_change(const Point& point) const;  // -1: none
  long double look_ahead() const;

  long double J_, D_, x_, v_, torque_ = 0;
  std::vector<Contact> contacts_;
  int events_ = 0;
};

// x' = A x + b held for h, by a scaled Taylor series of the exponential.
template <std::size_t S>
class HeldFlow {
 public:
  using Matrix = std::array<std::array<long double, S>, S>;
  HeldFlow(const Matrix& A, long double h) {
    // [A 1; 0 0] as S x S blocks: E = exp(A h), F = integral of it.
    long double norm = 0;
    for (const auto& row : A) {
      long double sum = 0;
      for (const long double a : row) sum += a < 0 ? -a : a;
      norm = sum > norm ? sum : norm;
    }
    int halvings = 0;
    while (norm * h > 0.25L) h /= 2, ++halvings;
    Matrix term{}, power{};
    for (std::size_t i = 0; i < S; ++i) E[i][i] = 1, power[i][i] = 1, F[i][i] = h;
    for (int n = 1; n < 30; ++n) {
      term = times(power, A);
      for (std::size_t i = 0; i < S; ++i) {
        for (std::size_t j = 0; j < S; ++j) {
          power[i][j] = term[i][j] * h / n;
          E[i][j] += power[i][j];
          F[i][j] += power[i][j] * h / (n + 1);
        }
      }
    }
    for (; halvings > 0; --halvings) {  // F(2h) = F + E F, E(2h) = E E
      const Matrix EF = times(E, F);
      for (std::size_t i = 0; i < S; ++i) {
        for (std::size_t j = 0; j < S; ++j) F[i][j] += EF[i][j];
      }
      E = times(E, E);
    }
  }
  void step(std::array<long double, S>& x, const std::array<long double, S>& b) const {
    std::array<long double, S> y{};
    for (std::size_t i = 0; i < S; ++i) {
      for (std::size_t j = 0; j < S; ++j) y[i] += E[i][j] * x[j] + F[i][j] * b[j];
    }
    x = y;
  }

 private:
  static Matrix times(const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < S; ++i) {
      for (std::size_t k = 0; k < S; ++k) {
        for (std::size_t j = 0; j < S; ++j) c[i][j] += a[i][k] * b[k][j];
      }
    }
    return c;
  }
  Matrix E{}, F{};
};

// An axis with LuGre friction under a torque that is held in pieces; Fehlberg 7(8) in long double to 1e-15.
struct LuGrePlan {
  double J, sigma_0, sigma_1, sigma_2, F_c, F_s, v_s;
  std::vector<double> torques;  // each held for `seconds`
  double seconds;
};
// The motor of the product with the same axis and friction, and nothing else.
MotorAxis::Params motor_of(const LuGrePlan& plan);
// x, v and bristle torque after each piece.
std::vector<std::array<double, 3>> lugre_reference(const LuGrePlan& plan);

}  // namespace farhand::extreme
