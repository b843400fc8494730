// The law of the orthosis MCU in double precision, written from the equations and not from the core: what its scaled
// integers are judged by. After the start; no frames, no states.
#pragma once

#include <algorithm>
#include <cmath>

#include "slave/mcu/mcu_params.hpp"

namespace farhand::mcu {

class McuReference {
 public:
  explicit McuReference(const McuSettings& settings) : s(settings) {}

  void estimate(double x_new, double x_motor) {
    const double dt = 1 / s.loop_hz;
    if (loops_ > 0) look_ahead();
    ++loops_;
    x = x_new;
    tau_spring = s.spring * (x_motor - x);
    if (!started_) {
      started_ = true;
      x_previous_ = x;
      dob_ = rtob_ = tau_slow_ = tau_spring;
    }
    // Band-limited derivative as the difference quotient through a backward-Euler low-pass, not telescoped.
    v += s.g_v * dt / (1 + s.g_v * dt) * ((x - x_previous_) / dt - v);
    x_previous_ = x;
    const double a = s.g * dt / (1 + s.g * dt);
    dob_ += a * (tau_spring + s.J_n * s.g * v - dob_);
    rtob_ += a * (tau_spring - s.viscous * v + s.J_n * s.g * v - rtob_);
    tau_dis = dob_ - s.J_n * s.g * v;
    f_s = rtob_ - s.J_n * s.g * v;
  }

  // tau_allowed: what the start ramp leaves of the torque limit.
  double control(double x_ref, double v_ref, double f_ref, double tau_allowed) {
    return drive(s.K_p * (x_ref - x) + s.K_d * (v_ref - v) - s.K_f * (f_ref + f_s), tau_allowed);
  }
  // TORQUE.
  double give_torque(double v_ref, double f_ref, double tau_allowed) {
    return drive(s.K_f * (f_ref - f_s) + s.K_d * (v_ref - v), tau_allowed);
  }

  // By torque that resists, which the core knows in steps of 1/32 N m.
  double v_allow(double resisting) const {
    const double known = (std::clamp(std::floor(resisting * 32), 0.0, 127.0) + 0.5) / 32;
    const double by_torque = 1.25 * s.velocity_limit * std::max(1.07 - known / s.torque_limit, 0.0);
    return std::min({s.velocity_limit, s.power_limit / (known + 0.1), by_torque});
  }

  McuSettings s;
  bool bounded = false;  // the last acceleration was
  double x = 0, v = 0, tau_spring = 0, tau_dis = 0, f_s = 0, tau_command = 0;

 private:
  double drive(double a_ref, double tau_allowed) {
    constexpr double k_B = 36, kEnd = 18;
    const double soon = 3.25 * rise_;
    double up = k_B * (v_allow(std::max(tau_spring, tau_dis) + std::max(soon, 0.0)) - std::max(v, 0.0));
    double down = -k_B * (v_allow(-std::min(tau_spring, tau_dis) - std::min(soon, 0.0)) + std::min(v, 0.0));
    (v > 0 ? up : down) += std::clamp(given_ahead_ / s.J_n, std::min(3 * k_B * v, 0.0), std::max(3 * k_B * v, 0.0));
    up = std::min(up, k_B * (v_allow(0) - std::max(v, 0.0)));
    down = std::max(down, -k_B * (v_allow(0) + std::min(v, 0.0)));
    (v > 0 ? down : up) = v > 0 ? std::min(down, up) : std::max(down, up);
    up = std::min(up, 2 * k_B * (kEnd * (s.range_max - x) - v));
    down = std::max(down, 2 * k_B * (kEnd * (s.range_min - x) - v));
    bounded = a_ref > up || a_ref < down;
    const double wanted = std::clamp(s.J_n * std::clamp(a_ref, down, up) + tau_dis, -tau_allowed, tau_allowed);
    const double step = s.torque_rate_limit / s.loop_hz;
    tau_command = std::clamp(wanted, tau_command - step, tau_command + step);
    return std::clamp(v + s.spring_gain * (tau_command - tau_spring), -s.motor_speed_limit, s.motor_speed_limit);
  }

  // In the first loop of each frame, of what it estimated.
  void look_ahead() {
    if ((loops_ - 1) % std::lround(s.loop_hz / 1000) != 0) return;
    rise_ = tau_dis - tau_slow_;
    tau_slow_ += rise_ / 16;
    const double most = std::clamp((s.torque_limit - std::abs(tau_dis)) / 2, 0.0, 0.4);
    given_ahead_ = std::clamp(1.25 * rise_, -most, most);
  }

  bool started_ = false;
  double x_previous_ = 0, dob_ = 0, rtob_ = 0;
  double tau_slow_ = 0, rise_ = 0, given_ahead_ = 0;  // once a frame
  long loops_ = 0;
};

}  // namespace farhand::mcu
