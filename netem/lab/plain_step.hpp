// The same laws as in the scenes, written by hand for one joint: no block, no vector, no template over joints. It has
// four uses: a second computation of a scene's results (tests/scene_test.cpp), a measure of the cost of composing laws
// of blocks (scene_bench.cpp), in long double the law of a reference, and, with several runs side by side in a
// register, a fast law (netem/lab/bare_loop.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>

#include "common/signal/limit_bits.hpp"
#include "common/station/params.hpp"

namespace farhand {

enum class PlainScene { kFourChannel, kCdob, kCdobSdcv };

// u limited to [low, high] without a branch, so that T may also be several numbers side by side.
template <class T>
inline T plain_clip(T u, T low, T high) noexcept {
  const T raised = u < low ? low : u;
  return raised > high ? high : raised;
}

// A driven direct drive: encoder angle and received motion in, torque out. T: double, long double, or several doubles
// side by side (a vector of the compiler; `limits` then stays 0 and NaN is not caught).
template <PlainScene kScene, class T = double>
class PlainStep {
 public:
  explicit PlainStep(const ControlParams& p)
      : PlainStep([&p](auto setting) { return static_cast<T>(setting(p)); }, p.drive.model) {}

  // of(setting): the value of a setting, which is a function of ControlParams, for each run of T.
  template <class Of>
  PlainStep(const Of& of, const AxisModel& any)
      : dt_(of([](const ControlParams& p) { return p.drive.dt_s; })),
        J_n_(of([](const ControlParams& p) { return p.drive.model.J_n; })),
        viscous_(of([](const ControlParams& p) { return p.drive.model.viscous; })),
        coulomb_(of([](const ControlParams& p) { return p.drive.model.coulomb; })),
        gravity_(of([](const ControlParams& p) { return p.drive.model.gravity; })),
        gravity_angle_(of([](const ControlParams& p) { return p.drive.model.gravity_angle; })),
        K_p_(of([](const ControlParams& p) { return p.drive.K.K_p; })),
        K_d_(of([](const ControlParams& p) { return p.drive.K.K_d; })),
        K_f_(of([](const ControlParams& p) { return p.drive.K.K_f; })),
        K_f_model_(of(
            [](const ControlParams& p) { return p.law.local_model == LocalModel::kWithForce ? p.drive.K.K_f : 0.0; })),
        a_v_(smoothing(of([](const ControlParams& p) { return p.drive.g_v.rad_s(); }))),
        v_gain_(a_v_ / dt_),
        a_dis_(smoothing(of([](const ControlParams& p) { return p.drive.g_dis.rad_s(); }))),
        gain_dis_(J_n_ * of([](const ControlParams& p) { return p.drive.g_dis.rad_s(); })),
        a_reac_(smoothing(of([](const ControlParams& p) { return p.drive.g_reac.rad_s(); }))),
        gain_reac_(J_n_ * of([](const ControlParams& p) { return p.drive.g_reac.rad_s(); })),
        a_net_(smoothing(of([](const ControlParams& p) { return p.law.g_net.rad_s(); }))),
        a_alpha_(smoothing(of([](const ControlParams& p) { return p.law.sdcv.alpha_cutoff.rad_s(); }))),
        f_2_(of([](const ControlParams& p) { return p.law.sdcv.f_2; })),
        alpha_slope_(1.0 / (f_2_ - of([](const ControlParams& p) { return p.law.sdcv.f_1; }))),
        limit_(of([](const ControlParams& p) { return p.drive.gate.torque; })),
        torque_step_(dt_ * of([](const ControlParams& p) { return p.drive.gate.torque_rate; })),
        range_min_(of([](const ControlParams& p) { return p.drive.gate.range_min; })),
        range_max_(of([](const ControlParams& p) { return p.drive.gate.range_max; })),
        fade_(limit_ / 0.0175),  // over the last degree
        rise_(dt_ / of([](const ControlParams& p) { return p.drive.take_over_s; })),
        weighs_(any.gravity != 0.0),
        rubs_(any.coulomb != 0.0) {}

  // Starts at rest at x.
  void reset(T x) noexcept {
    y_ = x;
    dis_ = T{};
    reac_ = -weight_at(x);
  }
  void start(T x_r, T v_r, T f_r) noexcept {
    x_model_ = x_r;
    v_model_ = v_r;
    x_cdob_ = v_cdob_ = T{};
    alpha_ = raw_alpha(f_r);
  }

  T step(T x, T x_r, T v_r, T f_r) noexcept {
    observe(x);
    return follow(x, x_r, v_r, f_r);
  }

  // The two halves of a step: the first needs only the encoder, the second the peer.
  void observe(T x) noexcept {
    const T ahead = x - y_;
    v = v_gain_ * ahead;
    y_ += a_v_ * ahead;
    const T momentum = gain_dis_ * v;
    dis_ += a_dis_ * (tau_ + momentum - dis_);
    tau_dis_ = dis_ - momentum;
    weight_ = weight_at(x);
    T known = weight_ + viscous_ * v;
    if (rubs_) known += coulomb_ * slip(v);
    const T momentum_reac = gain_reac_ * v;
    reac_ += a_reac_ * (tau_ - known + momentum_reac - reac_);
    f = reac_ - momentum_reac;
  }
  T follow(T x, T x_r, T v_r, T f_r) noexcept {
    T x_t = x_r, v_t = v_r;
    if constexpr (kScene != PlainScene::kFourChannel) {
      x_cdob_ += a_net_ * (x_model_ - x_r - x_cdob_);
      v_cdob_ += a_net_ * (v_model_ - v_r - v_cdob_);
      const T a_model = K_p_ * (x - (x_r + x_cdob_)) + K_d_ * (v - (v_r + v_cdob_)) - K_f_ * f - K_f_model_ * f_r;
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
    authority_ = authority_ > 1.0 ? T{} + 1.0 : authority_;
    const T wish = J_n_ * (K_p_ * (x_t - x) + K_d_ * (v_t - v) - K_f_ * (f + f_r)) + tau_dis_;
    return gate(weight_ + authority_ * (wish - weight_), x);
  }

  T tau_dis() const noexcept { return tau_dis_; }

  T v{}, f{};
  std::uint32_t limits = 0;

 private:
  static constexpr bool kOne = std::floating_point<T>;

  T smoothing(T g) const noexcept { return g * dt_ / (1.0 + g * dt_); }
  T raw_alpha(T f_r) const noexcept {
    return plain_clip<T>((f_2_ - (f_r < 0.0 ? -f_r : f_r)) * alpha_slope_, T{}, T{} + 1.0);
  }
  T weight_at(T x) const noexcept {
    if (!weighs_) return T{};
    return -gravity_ * each(x + gravity_angle_, [](auto angle) { return std::sin(angle); });
  }
  static T slip(T v) noexcept {
    return each(v / AxisModel::kStandstill, [](auto s) { return std::tanh(s); });
  }
  template <class F>
  static T each(T u, F of) noexcept {
    if constexpr (kOne) {
      return of(u);
    } else {
      for (std::size_t k = 0; k < sizeof(T) / sizeof(double); ++k) u[k] = of(u[k]);
      return u;
    }
  }
  // Limits u and records the limit that acted.
  T clip(T u, T low, T high, std::uint32_t bit) noexcept {
    if constexpr (kOne) {
      if (u < low || u > high) limits |= bit;
    }
    return plain_clip<T>(u, low, high);
  }

  T gate(T wish, T x) noexcept {
    limits = 0;
    T tau = wish, position = x;
    if constexpr (kOne) {
      if (!std::isfinite(wish) || !std::isfinite(x)) {
        tau = 0;
        limits |= kLimitNotFinite;
        if (!std::isfinite(x)) position = 0;
      }
    }
    tau = clip(tau, -limit_, limit_, kLimitTorque);
    const T up = plain_clip<T>((range_max_ - position) * fade_, T{}, limit_);
    const T down = plain_clip<T>((position - range_min_) * fade_, T{}, limit_);
    tau = clip(tau, -down, up, kLimitRange);
    tau_ += clip(tau - tau_, -torque_step_, torque_step_, kLimitRate);
    return tau_;
  }

  T dt_, J_n_, viscous_, coulomb_, gravity_, gravity_angle_, K_p_, K_d_, K_f_, K_f_model_;
  T a_v_, v_gain_, a_dis_, gain_dis_, a_reac_, gain_reac_, a_net_, a_alpha_, f_2_, alpha_slope_;
  T limit_, torque_step_, range_min_, range_max_, fade_, rise_;
  bool weighs_, rubs_;  // a sine and a hyperbolic tangent cost as much as the rest

  T y_{}, dis_{}, tau_dis_{}, reac_{}, weight_{}, tau_{}, authority_{};
  T x_model_{}, v_model_{}, x_cdob_{}, v_cdob_{}, alpha_{};
};

// A driven reference drive: angle and torque of the device and received motion in, references out.
template <class T = double>
class PlainReferenceStep {
 public:
  explicit PlainReferenceStep(const ControlParams& p)
      : dt_(p.drive.dt_s),
        a_v_(static_cast<T>(p.drive.g_v.rad_s()) * dt_ / (1 + static_cast<T>(p.drive.g_v.rad_s()) * dt_)),
        v_gain_(a_v_ / dt_),
        gate_(p.drive.gate),
        change_(gate_.acceleration * dt_) {}

  void reset(T x) noexcept {
    y_ = x_ref = wished_ = x;
    v_ref = f_ref = speed_ = 0;
  }
  void step(T x, T x_r, T v_r, T f_r) noexcept {
    v = v_gain_ * (x - y_);
    y_ += a_v_ * (x - y_);
    limits = 0;
    T aim = x_ref, v_in = 0, f_in = 0;
    if (std::isfinite(x_r) && std::isfinite(v_r) && std::isfinite(f_r)) {
      aim = clip(x_r, gate_.range_min, gate_.range_max, kLimitRange);
      v_in = clip(v_r, -gate_.velocity, gate_.velocity, kLimitVelocity);
      f_in = clip(f_r, -gate_.torque, gate_.torque, kLimitTorque);
    } else {
      limits = kLimitNotFinite;
    }
    const T step = gate_.velocity * dt_;
    T to = clip(aim, x_ref - step, x_ref + step, kLimitRate);
    if (std::isfinite(change_)) {
      to = accelerated(aim, to);
      speed_ = (to - x_ref) / dt_;
      wished_ = aim;
    }
    x_ref = to;
    v_ref = clip(v_in, v_ref - change_, v_ref + change_, kLimitAcceleration);
    f_ref = f_in;
  }

  T v = 0, x_ref = 0, v_ref = 0, f_ref = 0;
  std::uint32_t limits = 0;

 private:
  T clip(T u, T low, T high, std::uint32_t bit) noexcept {
    if (u < low || u > high) limits |= bit;
    return plain_clip<T>(u, low, high);
  }

  // Largest speed at the beginning of a distance that ends at rest, if each tick reduces the speed by change_.
  T entered(T way) const noexcept {
    const T q = way > 0 ? way / (change_ * dt_) : T{};
    const T whole = std::floor((std::sqrt(1 + 8 * q) - 1) / 2);
    return change_ * (whole + (q - whole * (whole + 1) / 2) / (whole + 1));
  }
  T accelerated(T aim, T to) noexcept {
    const T behind = wished_ - x_ref;
    T wish = (to - x_ref) / dt_;
    if (behind != 0) wish = (aim - wished_) / dt_ + std::copysign(entered(std::abs(behind)), behind);
    const T high = std::min({T(gate_.velocity), speed_ + change_, entered(gate_.range_max - x_ref)});
    const T low = std::max({T(-gate_.velocity), speed_ - change_, -entered(x_ref - gate_.range_min)});
    const T speed = plain_clip<T>(plain_clip<T>(wish, std::min(low, high), high), speed_ - change_, speed_ + change_);
    const T next =
        plain_clip<T>(x_ref + speed * dt_, std::min<T>(gate_.range_min, x_ref), std::max<T>(gate_.range_max, x_ref));
    if (std::abs(next - to) < kRounding) return to;
    limits |= kLimitAcceleration;
    return std::abs(next - aim) < kRounding ? aim : next;
  }

  static constexpr double kRounding = 1e-12;
  T dt_, a_v_, v_gain_;
  GateParams gate_;
  T change_, y_ = 0, speed_ = 0, wished_ = 0;
};

}  // namespace farhand
