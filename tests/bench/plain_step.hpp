// The same laws as the scenes, written by hand in plain doubles for one joint: no block, no vector, no template over
// joints. It is the second opinion on what a scene computes (tests/scene_test.cpp) and the measure of what composing it
// of blocks costs (scene_bench.cpp).
#pragma once

#include <cmath>
#include <cstdint>

#include "common/scene/four_channel.hpp"

namespace farhand {

enum class PlainScene { kFourChannel, kCdob, kCdobSdcv };

// A driven direct drive: encoder angle and received motion in, torque out.
template <PlainScene kScene>
class PlainStep {
 public:
  explicit PlainStep(const SceneParams& p)
      : dt_(p.drive.dt_s),
        J_n_(p.drive.model.J_n),
        viscous_(p.drive.model.viscous),
        coulomb_(p.drive.model.coulomb),
        gravity_(p.drive.model.gravity),
        gravity_angle_(p.drive.model.gravity_angle),
        K_p_(p.drive.K.K_p),
        K_d_(p.drive.K.K_d),
        K_f_(p.drive.K.K_f),
        a_v_(smoothing(p.drive.g_v)),
        v_gain_(a_v_ / dt_),
        a_dis_(smoothing(p.drive.g_dis)),
        gain_dis_(J_n_ * p.drive.g_dis.rad_s()),
        a_reac_(smoothing(p.drive.g_reac)),
        gain_reac_(J_n_ * p.drive.g_reac.rad_s()),
        a_net_(smoothing(p.g_net)),
        a_alpha_(smoothing(p.sdcv.alpha_cutoff)),
        f_1_(p.sdcv.f_1),
        f_2_(p.sdcv.f_2),
        with_force_(p.local_model == LocalModel::kWithForce),
        limit_(p.drive.gate.torque),
        torque_step_(p.drive.gate.torque_rate * dt_),
        range_min_(p.drive.gate.range_min),
        range_max_(p.drive.gate.range_max),
        rise_(dt_ / p.drive.take_over_s) {}

  void reset(double x) noexcept {
    y_ = x;
    dis_ = 0.0;
    reac_ = gravity_ * std::sin(x + gravity_angle_);
  }
  void start(double x_r, double v_r, double f_r) noexcept {
    x_model_ = x_r;
    v_model_ = v_r;
    x_cdob_ = v_cdob_ = 0.0;
    alpha_ = raw_alpha(f_r);
  }

  double step(double x, double x_r, double v_r, double f_r) noexcept {
    v = v_gain_ * (x - y_);
    y_ += a_v_ * (x - y_);
    dis_ += a_dis_ * (tau_ + gain_dis_ * v - dis_);
    const double tau_dis = dis_ - gain_dis_ * v;
    const double weight = -gravity_ * std::sin(x + gravity_angle_);
    const double known = weight + viscous_ * v + coulomb_ * std::tanh(v / AxisModel::kStandstill);
    reac_ += a_reac_ * (tau_ - known + gain_reac_ * v - reac_);
    f = reac_ - gain_reac_ * v;

    double x_t = x_r, v_t = v_r;
    if constexpr (kScene != PlainScene::kFourChannel) {
      x_cdob_ += a_net_ * (x_model_ - x_r - x_cdob_);
      v_cdob_ += a_net_ * (v_model_ - v_r - v_cdob_);
      double a_model = K_p_ * (x - (x_r + x_cdob_)) + K_d_ * (v - (v_r + v_cdob_)) - K_f_ * f;
      if (with_force_) a_model -= K_f_ * f_r;
      v_model_ += dt_ * a_model;
      x_model_ += dt_ * v_model_;
      if constexpr (kScene == PlainScene::kCdobSdcv) {
        alpha_ += a_alpha_ * (raw_alpha(f_r) - alpha_);
        x_t = x_r + alpha_ * x_cdob_;
        v_t = v_r + alpha_ * v_cdob_;
      } else {
        x_t = x_r + x_cdob_;
        v_t = v_r + v_cdob_;
      }
    }

    authority_ += rise_;
    if (authority_ > 1.0) authority_ = 1.0;
    const double wish = J_n_ * (K_p_ * (x_t - x) + K_d_ * (v_t - v) - K_f_ * (f + f_r)) + tau_dis;
    return gate(weight + authority_ * (wish - weight), x);
  }

  double v = 0.0, f = 0.0;
  std::uint32_t limits = 0;

 private:
  double smoothing(Cutoff g) const noexcept { return g.rad_s() * dt_ / (1.0 + g.rad_s() * dt_); }
  double raw_alpha(double f_r) const noexcept {
    const double raw = (f_2_ - std::fabs(f_r)) / (f_2_ - f_1_);
    return raw < 0.0 ? 0.0 : (raw > 1.0 ? 1.0 : raw);
  }

  double gate(double wish, double x) noexcept {
    limits = 0;
    double tau = wish, position = x;
    if (!std::isfinite(wish) || !std::isfinite(x)) {
      tau = 0.0;
      limits |= kLimitNotFinite;
      if (!std::isfinite(x)) position = 0.0;
    }
    if (tau > limit_) {
      tau = limit_;
      limits |= kLimitTorque;
    } else if (tau < -limit_) {
      tau = -limit_;
      limits |= kLimitTorque;
    }
    constexpr double kDegree = 0.0175;
    double up = (range_max_ - position) / kDegree, down = (position - range_min_) / kDegree;
    up = limit_ * (up < 0.0 ? 0.0 : (up > 1.0 ? 1.0 : up));
    down = limit_ * (down < 0.0 ? 0.0 : (down > 1.0 ? 1.0 : down));
    if (tau > up) {
      tau = up;
      limits |= kLimitRange;
    } else if (tau < -down) {
      tau = -down;
      limits |= kLimitRange;
    }
    if (tau - tau_ > torque_step_) {
      tau = tau_ + torque_step_;
      limits |= kLimitRate;
    } else if (tau - tau_ < -torque_step_) {
      tau = tau_ - torque_step_;
      limits |= kLimitRate;
    }
    tau_ = tau;
    return tau;
  }

  double dt_, J_n_, viscous_, coulomb_, gravity_, gravity_angle_, K_p_, K_d_, K_f_;
  double a_v_, v_gain_, a_dis_, gain_dis_, a_reac_, gain_reac_, a_net_, a_alpha_, f_1_, f_2_;
  bool with_force_;
  double limit_, torque_step_, range_min_, range_max_, rise_;

  double y_ = 0.0, dis_ = 0.0, reac_ = 0.0, tau_ = 0.0, authority_ = 0.0;
  double x_model_ = 0.0, v_model_ = 0.0, x_cdob_ = 0.0, v_cdob_ = 0.0, alpha_ = 1.0;
};

// A driven reference drive: angle and torque of the device and received motion in, references out.
class PlainReferenceStep {
 public:
  explicit PlainReferenceStep(const SceneParams& p)
      : a_v_(p.drive.g_v.rad_s() * p.drive.dt_s / (1.0 + p.drive.g_v.rad_s() * p.drive.dt_s)),
        v_gain_(a_v_ / p.drive.dt_s),
        gate_(p.drive.gate),
        step_(p.drive.gate.velocity * p.drive.dt_s) {}

  void reset(double x) noexcept {
    y_ = x_ref = x;
    v_ref = f_ref = 0.0;
  }
  void step(double x, double x_r, double v_r, double f_r) noexcept {
    v = v_gain_ * (x - y_);
    y_ += a_v_ * (x - y_);
    limits = 0;
    if (!std::isfinite(x_r) || !std::isfinite(v_r) || !std::isfinite(f_r)) {
      v_ref = f_ref = 0.0;
      limits = kLimitNotFinite;
      return;
    }
    const double x_in = clip(x_r, gate_.range_min, gate_.range_max, kLimitRange);
    x_ref = clip(x_in, x_ref - step_, x_ref + step_, kLimitRate);
    v_ref = clip(v_r, -gate_.velocity, gate_.velocity, kLimitVelocity);
    f_ref = clip(f_r, -gate_.torque, gate_.torque, kLimitTorque);
  }

  double v = 0.0, x_ref = 0.0, v_ref = 0.0, f_ref = 0.0;
  std::uint32_t limits = 0;

 private:
  double clip(double u, double low, double high, std::uint32_t bit) noexcept {
    if (u < low) {
      limits |= bit;
      return low;
    }
    if (u > high) {
      limits |= bit;
      return high;
    }
    return u;
  }

  double a_v_, v_gain_;
  GateParams gate_;
  double step_, y_ = 0.0;
};

}  // namespace farhand
