// Model-mediated force feedback: the therapist feels, without delay, a model of the object that the patient's side
// touches. The network only carries the data from which the model is learnt (after Mitra & Niemeyer 2008).
//
//   f_model = k (x_p - x_0) + b v_fast beyond x_0, never pulling          a_p = C_p (x_m - x_p) - K_f (f_m + f_model)
//
// x_p is the predicted angle of the slave, at the time when the master's present motion will have reached it; the
// prediction obeys the slave's own law. The master runs four channels against (x_p, v_p, f_model) without delay, so
// that no fast loop crosses the network. The patient's side runs plain four channels, and packets carry the same
// content as for these. k and x_0 are learnt from the slave's motion as played out, separately for each direction: a
// hand resists in both, a wall in one.
//
// At rest the laws of master and model give x_p = x_m and f_model = -f_m. The slave's law then gives x_s = x_m, once
// x_0 is such that the model's torque equals the torque at the slave: the steady force does not depend on k. Only x_0
// still crosses the network, and the gain around that loop is (k_true - k)/(K_h + k). It is below 1 for every arm K_h
// if k is at least half of k_true. A wall is modelled as a spring of kStiffest whose x_0 moves to where the torque is
// right.
//
// Until k is learnt, a wall is softer in the model than in reality. The slave behind it then acts as a spring of
// K_p/K_f, by its own law, whose force reaches the therapist through x_0 and one delay late. Delay removes damping,
// most at the resonance of the inertia 1/K_f on that spring (14 to 20 rad/s). Therefore x_0 follows well below this
// frequency, and damping is added above it.
//
// After a gap in time the motion shown of the slave leaps, and a k learnt from the leaps would be wrong: only x_0
// follows, slowly. If x_0 waited too, a host that stops for some ms again and again would never learn the contact, and
// the therapist would not feel it.
//
// A patient who moves actively, trembles or has a spastic catch does not behave as a spring. While torque and angle are
// uncorrelated, or negatively correlated, k is frozen and only x_0 follows. A change of k does not change the present
// torque. Friction of the slave's tendons is estimated (common/observer/tendon_friction.hpp) and, in free motion,
// subtracted before the contact is learnt. The slave is sent the torque that overcomes this friction, so that it
// neither drags nor lags. A reaction that may be friction begins no contact, and x_0 rests while it is wrong by less
// than a share of the friction that was seen or swept.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/law/params.hpp"
#include "common/observer/fitted_line.hpp"
#include "common/observer/tendon_friction.hpp"
#include "common/signal/known_friction.hpp"
#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// Which part of the model may be learnt from the motion of the peer.
enum class Learns { kNothing, kWhere, kAll };  // while nothing newer is shown; just after a gap in time; else

// Friction in the reaction of the slave's device, N m: the most that it may hold, and what was seen of it.
struct ReactionFriction {
  double most = 0.0, seen = 0.0;
};

// The contact that resists rising angles. Contact with falling angles is the mirror image.
class ContactModel {
 public:
  // K_f: of the law, 1/(kg m2).
  ContactModel(double K_f, double dt_s)
      : learn_(LowPass<1>(Cutoff::rad_s(kLearn), dt_s).smoothing()),
        settle_(LowPass<1>(Cutoff::rad_s(kSettle), dt_s).smoothing()),
        growth_(std::pow(kGrowth, dt_s)),
        step_(kSpeed * dt_s),
        critical_(2 * kDamping / std::sqrt(K_f)) {}

  // x, f: the slave's angle and reaction as played out; x_p: where its model is now. hand: the reaction without the
  // friction of the slave's device, as far as this is known. friction: what f holds of it.
  void learn(double x, double f, double x_p, Learns learns = Learns::kAll) noexcept { learn(x, f, f, {}, x_p, learns); }
  void learn(double x, double f, double hand, const ReactionFriction& friction, double x_p, Learns learns) noexcept {
    if (!std::exchange(begun_, true)) x_ = x, f_ = hand, whole_ = f;
    x_ += learn_ * (x - x_);
    f_ += learn_ * (hand - f_);
    whole_ += learn_ * (f - whole_);
    if (learns == Learns::kNothing) return;
    const bool before = pressed_;
    pressed_ = whole_ > (pressed_ ? kRelease : kTouch) + kAbove * friction.most;
    if (pressed_ && !before) begin(x_p);
    if (pressed_ && learns == Learns::kAll) identify();
    if (!known_) return;
    const double k_before = std::exchange(k_, std::clamp(aim_, k_ / growth_, k_ * growth_));
    if (x_p > x_0_) x_0_ = x_p - (x_p - x_0_) * k_before / k_;  // the present torque does not change
    if (pressed_ || k_ * (x_ - x_0_) > kRelease) {
      const double measured = x_ - std::max(0.0, f_) / k_;
      const double band = std::min(kMostBand, kBand * friction.seen) / k_, off = measured - x_0_;
      x_0_ += std::clamp(settle_ * (off - std::clamp(off, -band, band)), -step_, step_);
    }
  }

  // Torque at the model's angle, N m. v_fast: part of its velocity that is faster than voluntary motion, rad/s.
  double force(double x_p, double v_fast) const noexcept {
    if (!known_ || x_p <= x_0_) return 0.0;
    return std::max(0.0, k_ * (x_p - x_0_) + critical_ * std::sqrt(k_) * v_fast);
  }

  // N m/rad.
  double k() const noexcept { return k_; }
  // g: cut-off with which x_0 follows from now on, rad/s.
  void settle(double g, double dt_s) noexcept { settle_ = LowPass<1>(Cutoff::rad_s(g), dt_s).smoothing(); }

 private:
  static constexpr double kTouch = 0.05, kRelease = 0.02;  // N m: kLearn reduces noise of 0.024 to 0.0012
  // Times the friction: a reaction below this is no contact. A hand that pushes back with the friction and kTouch is
  // felt for sure, because a device that moves into it adds its friction to the reaction.
  static constexpr double kAbove = 1.2;
  // x_0 rests while the model's torque is wrong by less than kBand times the friction, at most kMostBand, N m. Else it
  // would hunt: the slave sticks until the torque has passed the friction, slips, and sticks too far.
  static constexpr double kBand = 0.6, kMostBand = 0.04;
  static constexpr double kFirst = 3.0;                      // N m/rad, before anything was learnt
  static constexpr double kSoftest = 0.2, kStiffest = 30.0;  // N m/rad
  static constexpr double kLearn = 50.0;                     // rad/s
  static constexpr double kSettle = 8.0;                     // rad/s, of x_0
  static constexpr double kSpeed = 0.5;                      // rad/s, largest speed of x_0
  static constexpr double kGrowth = 10.0;                    // largest factor by which k changes in a second
  static constexpr double kDamping = 0.8;   // ratio, of the model's spring and the inertia 1/K_f of both sides
  static constexpr double kMemory = 0.97;   // forgetting factor per sample
  static constexpr double kAlike = 0.5;     // square of the correlation
  static constexpr double kPrior = 3000.0;  // signal-to-noise at which fitted slope and prior count the same

  void begin(double x_p) noexcept {
    line_.forget();
    if (!known_) x_0_ = std::max(x_p, x_ - f_ / k_);  // so that the torque begins at zero
    known_ = true;
  }

  void identify() noexcept {
    if (!line_.add(x_, f_) || line_.samples() < 3) return;
    const double xx = line_.xx(), ff = line_.ff(), xf = line_.xf();
    // In a patient who moves actively, torque and angle are uncorrelated: nothing can be learnt. Or torque falls while
    // the angle rises: then the k learnt so far may be wrong, too.
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
  double x_ = 0.0, f_ = 0.0, whole_ = 0.0;
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

  // g: cut-off with which x_0 follows from now on, rad/s.
  void settle(double g) noexcept {
    for (Contacts* side : {&rising_, &falling_}) {
      for (ContactModel& contact : *side) contact.settle(g, dt_s_);
    }
  }

  // The model starts at the last received motion of the slave. What was learnt stays.
  void reset(const Motion<N>& received) noexcept {
    slave_ = {received.x, received.v, Joints<N>::Zero()};
    for (Device& device : devices_) device.taken_off = 0.0;
    v_slow_.reset(received.v);
  }

  // local: the master now; received: the slave as played out. Returns the model of the slave at this instant.
  // calm: the last gap in time is long enough ago to learn friction.
  // told: what the slave says of the friction of its device.
  const Motion<N>& step(const Motion<N>& local, const Motion<N>& received, Learns learns = Learns::kAll,
                        bool calm = true, KnownFriction told = {}) noexcept {
    for (int j = 0; j < N; ++j) {
      ContactModel &up = rising_[static_cast<std::size_t>(j)], &down = falling_[static_cast<std::size_t>(j)];
      Device& device = devices_[static_cast<std::size_t>(j)];
      device.told = {std::min(told.threshold, kMostTold), told.known};
      const double f = received.f[j], x = received.x[j];
      const ReactionFriction inside{device.most(), device.F_c()};
      const double hand = f - unloaded(j) * friction(device, x, f, local.x[j], calm);
      up.learn(x, f, hand, inside, slave_.x[j], learns);
      down.learn(-x, -f, -hand, inside, -slave_.x[j], learns);
      const double v_fast = slave_.v[j] - v_slow_.value()[j];
      slave_.f[j] = up.force(slave_.x[j], v_fast) - down.force(-slave_.x[j], -v_fast);
    }
    const Joints<N> a = K_.K_p * (local.x - slave_.x) + K_.K_d * (local.v - slave_.v) - K_.K_f * (local.f + slave_.f);
    slave_.v += dt_s_ * a;
    slave_.x += dt_s_ * slave_.v;
    v_slow_.step(slave_.v);
    return slave_;
  }

  // Torque that the patient's device needs beside the therapist's torque, at the master's present position, N m.
  Joints<N> device_needs() const noexcept {
    Joints<N> all;
    for (int j = 0; j < N; ++j) {
      const Device& device = devices_[static_cast<std::size_t>(j)];
      all[j] = unloaded(j) * device.taken_off * device.here.value();
    }
    return all;
  }
  // Stiffness of the first joint's contact with rising angles, N m/rad.
  double k_rising() const noexcept { return rising_[0].k(); }
  double k_falling() const noexcept { return falling_[0].k(); }
  double friction() const noexcept { return devices_[0].F_c(); }  // N m, of the first joint's device; 0 while unknown

 private:
  struct Device {
    TendonFriction tendons;
    Hysteresis there, here;  // driven by the slave's angle as played out, and by the master's
    double taken_off = 0.0;  // N m, of the friction, fading in
    KnownFriction told;
    // What the reaction holds of it: never less than what was measured with nothing in the device. 0 while unknown.
    double F_c() const noexcept { return told.known ? std::max(told.threshold, tendons.F_c()) : tendons.F_c(); }
    // What it may hold of it.
    double most() const noexcept { return told.known || tendons.found() ? F_c() : told.threshold; }
  };
  // Friction is subtracted from the learnt torque, and given to the device, in free motion only. Under load a torque
  // that changes sign with the motion would cause oscillation; friction then appears as a difference between the sides.
  double unloaded(int j) const noexcept {
    const double off = devices_[static_cast<std::size_t>(j)].taken_off;
    return off > 0.0 ? std::clamp(2.0 - 2.0 * std::abs(slave_.f[j]) / off, 0.0, 1.0) : 0.0;
  }
  // The part of the slave's torque that is friction of its device, N m.
  double friction(Device& device, double x, double f, double x_m, bool calm) noexcept {
    if (calm) {
      device.tendons.step(x, f);
    } else {
      device.tendons.go_on(x);
    }
    if (device.F_c() == 0.0 && device.taken_off == 0.0) return 0.0;
    const double L = std::max(device.tendons.L(), device.taken_off / kSteepest), step = kFriction * dt_s_;
    device.there.step(x, L);
    device.here.step(x_m, L);
    device.taken_off += std::clamp(device.F_c() - device.taken_off, -step, step);
    return device.taken_off * device.there.value();
  }

  using Contacts = std::array<ContactModel, static_cast<std::size_t>(N)>;
  static constexpr double kSteepest = 10.0;  // N m/rad: a torque that reverses over less motion causes oscillation
  static constexpr double kMostTold = 0.5;   // N m, beyond what an empty sweep can measure
  static constexpr double kFriction = 0.5;   // N m/s, at which the estimated friction takes effect

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
