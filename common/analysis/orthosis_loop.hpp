// The loop of the orthosis as its MCU runs it. A velocity-sourced motor pulls a spring, whose torque both observers get
// without delay. Around this works the four-channel law, with the remote motion at rest:
//
//   v_motor_ref = v + gain (tau_ref - tau_spring),   tau_ref = J_n [-K_p x - K_d v - K_f f] + tau_dis
//
// `axis` is the joint with the object that it touches. Tendon friction and the limits of motor and references are left
// out.
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

// Its motion from one loop of the MCU to the next, and the response of x and f to an added acceleration.
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
