// The patient's hand: spring and damper around a rest angle, in the orthosis from one time until another. Put in at a
// deflection, it pushes at once: that is what happens at the bedside, and the jump is left as it is.
#pragma once

#include <limits>

namespace farhand {

class Hand {
 public:
  struct Params {
    double stiffness = 2;
    double damping = 0.02;
    double rest = 0;
    double from = 0;  // s
    double until = 1e9;
  };

  explicit Hand(const Params& params) : p_(params) {}

  bool present(double t) const noexcept { return t >= p_.from && t < p_.until; }
  // The first time after t at which it comes or goes.
  double next_break(double t) const noexcept {
    if (t < p_.from) return p_.from;
    return t < p_.until ? p_.until : std::numeric_limits<double>::infinity();
  }
  // Of a hand that is present. Reaction, sign of Motion::f: positive resists positive motion.
  template <class T>
  T reaction(T x, T v) const noexcept {
    return T(p_.stiffness) * (x - T(p_.rest)) + T(p_.damping) * v;
  }
  double stored_energy(double x) const noexcept { return 0.5 * p_.stiffness * (x - p_.rest) * (x - p_.rest); }
  double dissipated_power(double v) const noexcept { return p_.damping * v * v; }
  const Params& params() const noexcept { return p_; }

 private:
  Params p_;
};

}  // namespace farhand
