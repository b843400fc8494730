// Model-mediated force feedback: the therapist feels a model of what the patient's side touches, here and now, and the
// network only teaches the model (after Mitra & Niemeyer 2008).
//
//   f_model = k (x_p - x_0) + b v_fast beyond x_0, never pulling          a_p = C_p (x_m - x_p) - K_f (f_m + f_model)
//
// x_p is the slave as it will be once it has seen what the master does now: it obeys the slave's own law. The master
// runs four channels against (x_p, v_p, f_model) without delay, so no fast loop crosses the network; the patient's side
// is plain four channels and packets carry what they always do. k and x_0 are learnt from the slave's motion as played
// out, on each side of the axis for itself: a hand resists both ways, a wall one.
//
// At rest the master's law and the model's give x_p = x_m and f_model = -f_m, and the slave's then x_s = x_m, as soon
// as x_0 says what the slave feels: the steady force does not depend on k. What is left to cross the network is x_0,
// and the gain around that loop is (k_true - k)/(K_h + k): below 1 for every arm K_h if k is at least half of k_true.
// A wall is a spring of kStiffest whose x_0 goes where the torque is right.
//
// While k is not learnt yet, a wall is softer in the model than it is, and the slave behind it presses by its own law:
// a spring of K_p/K_f that x_0 brings to the therapist late. What comes late takes damping away, most of it from the
// inertia 1/K_f on that spring (14 to 20 rad/s): x_0 is slow against that, and the damping is above it.
//
// After a gap in time what is shown leaps, and k would be learnt of the leaps: x_0 alone follows, slowly. Were it to
// wait too, a host that stops for some ms again and again would never learn what is touched, and the therapist would
// feel nothing of it.
//
// Who moves of himself, trembles or catches is no spring: where torque goes with no regard to the angle, or against it,
// k stays as it was and x_0 alone follows. When k changes, the torque here and now does not. Friction of the slave's
// tendons is named (common/observer/tendon_friction.hpp) and in free motion taken from what is learnt; the slave is
// sent what it needs to overcome it, so that it neither drags nor lags.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/law/params.hpp"
#include "common/observer/fitted_line.hpp"
#include "common/observer/tendon_friction.hpp"
#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// What may be learnt of what the peer shows.
enum class Learns { kNothing, kWhere, kAll };  // nothing newer of it is shown; a gap was a moment ago; else

// What resists rising angles. Falling ones are the same, mirrored.
class ContactModel {
 public:
  // K_f: of the law, 1/(kg m2).
  ContactModel(double K_f, double dt_s)
      : learn_(LowPass<1>(Cutoff::rad_s(kLearn), dt_s).smoothing()),
        settle_(LowPass<1>(Cutoff::rad_s(kSettle), dt_s).smoothing()),
        growth_(std::pow(kGrowth, dt_s)),
        step_(kSpeed * dt_s),
        critical_(2 * kDamping / std::sqrt(K_f)) {}

  // x, f: the slave's angle and reaction as played out; x_p: where its model is now.
  void learn(double x, double f, double x_p, Learns learns = Learns::kAll) noexcept {
    if (!std::exchange(begun_, true)) x_ = x, f_ = f;
    x_ += learn_ * (x - x_);
    f_ += learn_ * (f - f_);
    if (learns == Learns::kNothing) return;
    const bool before = pressed_;
    pressed_ = f_ > (pressed_ ? kRelease : kTouch);
    if (pressed_ && !before) begin(x_p);
    if (pressed_ && learns == Learns::kAll) identify();
    if (!known_) return;
    const double k_before = std::exchange(k_, std::clamp(aim_, k_ / growth_, k_ * growth_));
    if (x_p > x_0_) x_0_ = x_p - (x_p - x_0_) * k_before / k_;  // the torque here and now stays
    if (pressed_ || k_ * (x_ - x_0_) > kRelease) {
      const double measured = x_ - std::max(0.0, f_) / k_;
      x_0_ += std::clamp(settle_ * (measured - x_0_), -step_, step_);
    }
  }

  // N m, at the model's angle. v_fast: what of its velocity is faster than a person moves on purpose, rad/s.
  double force(double x_p, double v_fast) const noexcept {
    if (!known_ || x_p <= x_0_) return 0.0;
    return std::max(0.0, k_ * (x_p - x_0_) + critical_ * std::sqrt(k_) * v_fast);
  }

  // N m/rad.
  double k() const noexcept { return k_; }
  // rad/s: how fast x_0 follows from now on.
  void settle(double g, double dt_s) noexcept { settle_ = LowPass<1>(Cutoff::rad_s(g), dt_s).smoothing(); }

 private:
  static constexpr double kTouch = 0.05, kRelease = 0.02;    // N m: of the noise of 0.024 kLearn leaves 0.0012
  static constexpr double kFirst = 3.0;                      // N m/rad, before anything was learnt
  static constexpr double kSoftest = 0.2, kStiffest = 30.0;  // N m/rad
  static constexpr double kLearn = 50.0;                     // rad/s
  static constexpr double kSettle = 8.0;                     // rad/s, of x_0
  static constexpr double kSpeed = 0.5;                      // rad/s, of x_0 at most
  static constexpr double kGrowth = 10.0;                    // times in a second, k at most
  static constexpr double kDamping = 0.8;   // ratio, of the model's spring and the inertia 1/K_f of both sides
  static constexpr double kMemory = 0.97;   // of a sample at the next
  static constexpr double kAlike = 0.5;     // square of the correlation
  static constexpr double kPrior = 3000.0;  // so many squares of the noise what is learnt must reach over

  void begin(double x_p) noexcept {
    line_.forget();
    if (!known_) x_0_ = std::max(x_p, x_ - f_ / k_);  // the force begins at zero
    known_ = true;
  }

  void identify() noexcept {
    if (!line_.add(x_, f_) || line_.samples() < 3) return;
    const double xx = line_.xx(), ff = line_.ff(), xf = line_.xf();
    // Whoever moves of himself lets torque go with no regard to the angle: that teaches nothing; or fall where the
    // angle rises: then what was learnt of him may be as wrong.
    if (line_.moved()) {
      const bool alike = xf * xf > kAlike * xx * ff;
      if (alike && xf < 0) aim_ = std::max(aim_, kFirst);
      if (!alike || xf < 0) return;
    }
    const double slope = xf > 0 ? line_.slope() : kStiffest;
    constexpr double kNoiseX = FittedLine::kNoiseX, kNoiseF = FittedLine::kNoiseF;
    const double reach = line_.samples() * (xx / (kNoiseX * kNoiseX) + ff / (kNoiseF * kNoiseF));
    const double trust = reach / (reach + kPrior);
    aim_ = std::clamp(std::pow(kFirst, 1 - trust) * std::pow(std::max(slope, kSoftest), trust), kSoftest, kStiffest);
  }

  double learn_, settle_, growth_, step_, critical_;
  double k_ = kFirst, aim_ = kFirst, x_0_ = 0.0;
  double x_ = 0.0, f_ = 0.0;
  FittedLine line_{kMemory};
  bool begun_ = false, known_ = false, pressed_ = false;
};

template <int N>
class Mediator {
 public:
  Mediator(const FourChannelGains& K, double dt_s)
      : K_(K),
        dt_s_(dt_s),
        rising_(make(K.K_f, dt_s)),
        falling_(make(K.K_f, dt_s)),
        v_slow_(Cutoff::rad_s(kOnPurpose), dt_s) {}

  // rad/s: how fast x_0 follows from now on.
  void settle(double g) noexcept {
    for (Contacts* side : {&rising_, &falling_}) {
      for (ContactModel& contact : *side) contact.settle(g, dt_s_);
    }
  }

  // The model starts where the slave was last heard of. What was learnt stays.
  void reset(const Motion<N>& received) noexcept {
    slave_ = {received.x, received.v, Joints<N>::Zero()};
    for (Device& device : devices_) device.named = 0.0;
    v_slow_.reset(received.v);
  }

  // local: the master now; received: the slave as played out. Returns the model of the slave at this instant.
  // calm: the last gap in time is long enough ago to learn friction.
  const Motion<N>& step(const Motion<N>& local, const Motion<N>& received, Learns learns = Learns::kAll,
                        bool calm = true) noexcept {
    for (int j = 0; j < N; ++j) {
      ContactModel &up = rising_[static_cast<std::size_t>(j)], &down = falling_[static_cast<std::size_t>(j)];
      const double f = received.f[j] - unloaded(j) * friction(devices_[static_cast<std::size_t>(j)], received.x[j],
                                                              received.f[j], local.x[j], calm);
      up.learn(received.x[j], f, slave_.x[j], learns);
      down.learn(-received.x[j], -f, -slave_.x[j], learns);
      const double v_fast = slave_.v[j] - v_slow_.value()[j];
      slave_.f[j] = up.force(slave_.x[j], v_fast) - down.force(-slave_.x[j], -v_fast);
    }
    const Joints<N> a = K_.K_p * (local.x - slave_.x) + K_.K_d * (local.v - slave_.v) - K_.K_f * (local.f + slave_.f);
    slave_.v += dt_s_ * a;
    slave_.x += dt_s_ * slave_.v;
    v_slow_.step(slave_.v);
    return slave_;
  }

  // N m, what the patient's device needs beside the therapist's torque where the master is now.
  Joints<N> device_needs() const noexcept {
    Joints<N> all;
    for (int j = 0; j < N; ++j) {
      const Device& device = devices_[static_cast<std::size_t>(j)];
      all[j] = unloaded(j) * device.named * device.here.value();
    }
    return all;
  }
  // Of the first joint, N m/rad.
  double k_rising() const noexcept { return rising_[0].k(); }
  double k_falling() const noexcept { return falling_[0].k(); }
  double friction_named() const noexcept { return devices_[0].tendons.F_c(); }  // N m

 private:
  struct Device {
    TendonFriction tendons;
    Hysteresis there, here;  // at the slave as played out, and at the master
    double named = 0.0;      // N m, fading in
  };
  // Friction is taken from what is learnt, and given to the device, in free motion only: under load a torque that turns
  // with the angle would shake, and what friction takes there shows as a difference of the sides.
  double unloaded(int j) const noexcept {
    const double named = devices_[static_cast<std::size_t>(j)].named;
    return named > 0.0 ? std::clamp(2.0 - 2.0 * std::abs(slave_.f[j]) / named, 0.0, 1.0) : 0.0;
  }
  // Of what the slave tells, how much is the friction of its device.
  double friction(Device& device, double x, double f, double x_m, bool calm) noexcept {
    if (calm) {
      device.tendons.step(x, f);
    } else {
      device.tendons.go_on(x);
    }
    if (device.tendons.F_c() == 0.0 && device.named == 0.0) return 0.0;
    const double L = std::max(device.tendons.L(), device.named / kSteepest), step = kFriction * dt_s_;
    device.there.step(x, L);
    device.here.step(x_m, L);
    device.named += std::clamp(device.tendons.F_c() - device.named, -step, step);
    return device.named * device.there.value();
  }

  using Contacts = std::array<ContactModel, static_cast<std::size_t>(N)>;
  static constexpr double kSteepest = 10.0;  // N m/rad: a torque that turns within less way shakes
  static constexpr double kFriction = 0.5;   // N m/s, at which what is named comes into force

  static Contacts make(double K_f, double dt_s) {
    return [&]<std::size_t... I>(std::index_sequence<I...>) { return Contacts{((void)I, ContactModel(K_f, dt_s))...}; }
    (std::make_index_sequence<static_cast<std::size_t>(N)>{});
  }

  FourChannelGains K_;
  double dt_s_;
  Contacts rising_, falling_;
  std::array<Device, static_cast<std::size_t>(N)> devices_;
  Motion<N> slave_;
  LowPass<N> v_slow_;
};

}  // namespace farhand
