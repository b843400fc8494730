// The loop of the orthosis, as its MCU runs it: a velocity-sourced motor pulls a spring, whose torque both observers
// see at once, and around it the four-channel law with the remote motion standing still:
//
//   v_motor_ref = v + gain (tau_ref - tau_spring),   tau_ref = J_n [-K_p x - K_d v - K_f f] + tau_dis
//
// axis is the joint with what it touches. Friction of the tendons and the limits of motor and references are left out.
#pragma once

#include <Eigen/Core>
#include <complex>

#include "common/analysis/held_axis.hpp"

namespace farhand {

struct OrthosisLoop {
  LoadedAxis axis;
  double spring = 10;         // N m/rad
  double motor_rate = 188.5;  // 1/s, of the drive's velocity loop
  double dt = 5e-4;           // s, of the MCU
  double spring_gain = 10;    // rad/s per N m
  double J_n = 4e-3;
  double viscous = 0.0;
  double K_p = 400.0, K_d = 40.0, K_f = 125.0;
  double g = 100.0, g_v = 500.0;
};

// From one loop of the MCU to the next, and how it answers an added acceleration with x and f.
class OrthosisMotion {
 public:
  explicit OrthosisMotion(const OrthosisLoop& loop);

  double spectral_radius() const;
  struct Answer {
    std::complex<double> x, f;
  };
  Answer to_acceleration(std::complex<double> z) const;

 private:
  // x, v, motor angle, motor speed; the filters of velocity, DOB and RTOB.
  static constexpr int kStates = 7;
  using Matrix = Eigen::Matrix<double, kStates, kStates>;
  using Vector = Eigen::Matrix<double, kStates, 1>;
  Matrix next_;
  Vector input_;
  Eigen::Matrix<double, 1, kStates> force_;
};

inline double spectral_radius(const OrthosisLoop& loop) { return OrthosisMotion(loop).spectral_radius(); }

}  // namespace farhand
