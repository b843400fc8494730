// The patient's hand: spring and damper around a rest angle, in the orthosis from one time until another. Put in at a
// deflection, it pushes at once: that is what happens at the bedside, and the jump is left as it is.
#pragma once

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

  // Reaction, sign of Motion::f: positive resists positive motion.
  double reaction(double t, double x, double v) const noexcept {
    return present(t) ? p_.stiffness * (x - p_.rest) + p_.damping * v : 0.0;
  }
  bool present(double t) const noexcept { return t >= p_.from && t < p_.until; }
  double stored_energy(double t, double x) const noexcept {
    return present(t) ? 0.5 * p_.stiffness * (x - p_.rest) * (x - p_.rest) : 0.0;
  }
  double dissipated_power(double t, double v) const noexcept { return present(t) ? p_.damping * v * v : 0.0; }
  const Params& params() const noexcept { return p_; }

 private:
  Params p_;
};

}  // namespace farhand
