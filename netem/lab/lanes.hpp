// Two runs side by side in one register: the law of one waits for no result of the other, and every operation serves
// both. Only what is the same for both is done so: the law, and a tick of the closed form in which no guard can fall
// and no movement is under way. Everything else falls back, lane by lane, on the closed form itself.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "common/integrate/closed_form.hpp"
#include "netem/lab/bare_loop.hpp"
#include "netem/lab/plain_step.hpp"

namespace farhand {

using Lanes = double __attribute__((vector_size(16)));
inline constexpr std::size_t kLanes = 2;

// As quantised() does to the last bit or two, lane by lane; 0 counts: ideal.
class LaneEncoder {
 public:
  explicit LaneEncoder(const std::array<double, kLanes>& counts_per_rev) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      ideal_ = ideal_ && !(counts_per_rev[k] > 0);
      per_rad_[k] = counts_per_rev[k] / (2.0 * std::numbers::pi);
      per_count_[k] = per_rad_[k] > 0 ? 1.0 / per_rad_[k] : 0.0;
    }
  }
  Lanes read(Lanes angle) const noexcept {
    if (ideal_) return angle;
    // Adding 1.5 * 2^52 rounds to a whole number; the comparison makes a floor of it.
    const Lanes shift = Lanes{} + 6755399441055744.0, wanted = angle * per_rad_ + 0.5;
    const Lanes whole = (wanted + shift) - shift;
    const Lanes floor = whole > wanted ? whole - 1.0 : whole;
    return per_rad_ > 0.0 ? floor * per_count_ : angle;
  }

 private:
  Lanes per_rad_{}, per_count_{};
  bool ideal_ = true;
};

template <class P>
class LanePlant {
 public:
  static constexpr std::size_t kStates = P::kStates;

  LanePlant(const std::array<P, kLanes>& plants, double tick_s) : plants_(plants), tick_s_(tick_s) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      exact_[k].start(plants_[k], 0.0, plants_[k].start());
      for (std::size_t i = 0; i < kStates; ++i) x_[i][k] = exact_[k].state()[i];
      known_[k].reserve(kModes);
      load(k);
    }
  }

  Lanes angle() const noexcept { return x_[0]; }

  // One tick, to t1, with the input held.
  void advance(Lanes input, double t1) noexcept {
    State z, y;
    for (std::size_t i = 0; i < kStates; ++i) {
      z[i] = now_.b[i] + now_.gain[i] * input;
      for (std::size_t j = 0; j < kStates; ++j) z[i] += now_.A[i][j] * x_[j];
    }
    // What the closed form proves: no guard can come down to zero within the tick.
    Lanes left = now_.fast;
    for (std::size_t g = 0; g < P::kGuards; ++g) {
      Lanes guard = now_.d[g];
      for (std::size_t i = 0; i < kStates; ++i) {
        const Lanes slope = z[i] < 0.0 ? -z[i] : z[i];
        guard += now_.c[g][i] * x_[i] - now_.reach[g][i] * slope;
      }
      left = guard < left ? guard : left;
    }
    for (std::size_t i = 0; i < kStates; ++i) {
      y[i] = x_[i];
      for (std::size_t j = 0; j < kStates; ++j) y[i] += now_.Psi[i][j] * z[j];
    }
    const bool first = left[0] > 0 && t1<until_[0], second = left[1]> 0 && t1 < until_[1];
    if (first && second) {
      x_ = y;
    } else {
      finish(0, first, input, y, t1);
      finish(1, second, input, y, t1);
    }
    t_ = t1;
  }

 private:
  using State = std::array<Lanes, kStates>;
  static constexpr std::size_t kModes = 8;

  // Of one lane, in one mode.
  struct Known {
    Mode mode;
    std::array<double, kStates> e, gain;
    AffineFlow<double, kStates> flow;  // without the held input
    SquareMatrix<double, kStates> Psi;
    std::array<AffineGuard<double, kStates>, P::kGuards> guards;
    std::array<std::array<std::array<double, kStates>, 2>, P::kGuards> reach;
  };
  // Of all lanes, in their modes of now.
  struct Now {
    std::array<Lanes, kStates> b, gain;
    std::array<std::array<Lanes, kStates>, kStates> A, Psi;
    std::array<std::array<Lanes, kStates>, P::kGuards> c, reach;
    std::array<Lanes, P::kGuards> d;
    Lanes fast;  // -1: this lane is left to the closed form
  };

  void finish(std::size_t k, bool proved, Lanes input, const State& y, double t1) noexcept {
    if (proved) {
      for (std::size_t i = 0; i < kStates; ++i) x_[i][k] = y[i][k];
      return;
    }
    std::array<double, kStates> x;
    for (std::size_t i = 0; i < kStates; ++i) x[i] = x_[i][k];
    plants_[k].hold(input[k]);
    if (exact_[k].time() != t_) exact_[k].place(t_, x);
    exact_[k].advance(plants_[k], t1);
    for (std::size_t i = 0; i < kStates; ++i) x_[i][k] = exact_[k].state()[i];
    if (exact_[k].mode() != loaded_[k] || !(t1 < until_[k])) load(k);
  }

  // What lane k needs for its mode of now.
  void load(std::size_t k) noexcept {
    const double t = exact_[k].time();
    loaded_[k] = exact_[k].mode();
    until_[k] = plants_[k].next_break(t);
    const Forcing<double> forcing = plants_[k].template forcing<double>(t);
    now_.fast[k] = forcing.constant() && exact_[k].status() == IntegratorStatus::kOk ? 1.0 : -1.0;
    if (now_.fast[k] < 0) return;
    const Known& known = know(k);
    const double r = forcing.polynomial[0];
    for (std::size_t i = 0; i < kStates; ++i) {
      now_.b[i][k] = known.flow.b[i] + known.flow.e[i] * r;
      now_.gain[i][k] = known.gain[i];
      for (std::size_t j = 0; j < kStates; ++j) {
        now_.A[i][j][k] = known.flow.A[i][j];
        now_.Psi[i][j][k] = known.Psi[i][j];
      }
    }
    for (std::size_t g = 0; g < P::kGuards; ++g) {
      const auto& guard = known.guards[g];
      using Kind = typename AffineGuard<double, kStates>::Kind;
      if (guard.kind == Kind::kMin) now_.fast[k] = -1;  // one form is not enough
      // Of two forms of which one must stay positive, the one that is further from zero.
      const std::array<double, kStates> x = exact_[k].state();
      const bool second = guard.kind == Kind::kMax && guard.second.value(x, r) > guard.first.value(x, r);
      const auto& form = second ? guard.second : guard.first;
      const bool never = guard.kind == Kind::kNever;
      now_.d[g][k] = never ? 1.0 : form.d + form.h * r;
      for (std::size_t i = 0; i < kStates; ++i) {
        now_.c[g][i][k] = never ? 0.0 : form.c[i];
        now_.reach[g][i][k] = never ? 0.0 : known.reach[g][second][i];
      }
    }
  }

  const Known& know(std::size_t k) noexcept {
    for (const Known& known : known_[k]) {
      if (known.mode == loaded_[k]) return known;
    }
    if (known_[k].size() == kModes) known_[k].erase(known_[k].begin());
    Known known;
    known.mode = loaded_[k];
    P& plant = plants_[k];
    plant.hold(1.0);
    const auto pushed = plant.template flow<double>(known.mode);
    plant.hold(0.0);
    known.flow = plant.template flow<double>(known.mode);
    for (std::size_t i = 0; i < kStates; ++i) known.gain[i] = pushed.b[i] - known.flow.b[i];
    known.guards = plant.template guard_forms<double>(known.mode);
    const auto wide = plant.template flow<long double>(known.mode);
    const auto response = respond(wide.A, wide.e, 0.0L, static_cast<long double>(tick_s_));
    for (std::size_t i = 0; i < kStates; ++i) {
      for (std::size_t j = 0; j < kStates; ++j) known.Psi[i][j] = static_cast<double>(response.Psi[i][j]);
    }
    bound(known);
    known_[k].push_back(known);
    return known_[k].back();
  }

  // Reach: the largest |c Psi(s)| within a tick, entry by entry. The tick is cut into pieces: Psi(s + tau) = Psi(s) +
  // Phi(s) Psi(tau), and |Psi(tau)| is at most the Psi of |A| for the whole piece.
  void bound(Known& known) noexcept {
    const AffineFlow<double, kStates>& flow = known.flow;
    const double pieces = std::ceil(4.0 + 4.0 * fastest_rate_of(flow.A) * tick_s_), length = tick_s_ / pieces;
    SquareMatrix<double, kStates> modulus = flow.A;
    for (auto& row : modulus) {
      for (double& entry : row) entry = std::fabs(entry);
    }
    const auto piece = respond(flow.A, std::array<double, kStates>{}, 0.0, length),
               most = respond(modulus, std::array<double, kStates>{}, 0.0, length);
    for (std::size_t g = 0; g < P::kGuards; ++g) {
      for (const bool second : {false, true}) {
        const auto& guard = known.guards[g];
        std::array<double, kStates> c_Phi = second ? guard.second.c : guard.first.c, c_Psi{};
        std::array<double, kStates>& reach = known.reach[g][second];
        reach = {};
        using Kind = typename AffineGuard<double, kStates>::Kind;
        if (guard.kind == Kind::kNever || (second && guard.kind == Kind::kOne)) continue;
        for (double done = 0; done < pieces; ++done) {
          std::array<double, kStates> Psi_next = c_Psi, Phi_next = c_Phi;
          for (std::size_t j = 0; j < kStates; ++j) {
            double within = std::fabs(c_Psi[j]);
            for (std::size_t i = 0; i < kStates; ++i) {
              within += std::fabs(c_Phi[i]) * most.Psi[i][j];
              Psi_next[j] += c_Phi[i] * piece.Psi[i][j];
              Phi_next[j] += c_Phi[i] * piece.D[i][j];
            }
            reach[j] = std::max(reach[j], within * 1.000001);
          }
          c_Psi = Psi_next, c_Phi = Phi_next;
        }
      }
    }
  }

  std::array<P, kLanes> plants_;
  std::array<ClosedForm<P>, kLanes> exact_;
  double tick_s_, t_ = 0;
  State x_{};
  Now now_{};
  std::array<Mode, kLanes> loaded_{};
  std::array<double, kLanes> until_{};
  std::array<std::vector<Known>, kLanes> known_;
};

// A side of a bare loop.
template <PlainScene kScene, class P>
class LaneSide {
 public:
  using Real = Lanes;

  LaneSide(const std::array<ControlParams, kLanes>& params, const std::array<P, kLanes>& plants,
           const std::array<double, kLanes>& counts_per_rev)
      : law_(
            [&params](auto setting) {
              return Lanes{setting(params[0]), setting(params[1])};
            },
            weighing(params)),
        plant_(plants, params[0].drive.dt_s),
        encoder_(counts_per_rev) {
    const Lanes x = encoder_.read(plant_.angle());
    law_.reset(x);
    law_.start(x, Lanes{}, Lanes{});
  }

  Sent<Lanes> step(const Sent<Lanes>& received, double /*t0*/, double t1) noexcept {
    x_ = encoder_.read(plant_.angle());
    plant_.advance(law_.step(x_, received.x, received.v, received.f), t1);
    return sent();
  }
  Sent<Lanes> sent() const noexcept { return {x_, law_.v, law_.f}; }
  Lanes angle() const noexcept { return plant_.angle(); }

 private:
  // Which of the known torques any lane has.
  static AxisModel weighing(const std::array<ControlParams, kLanes>& params) {
    AxisModel any = params[0].drive.model;
    for (const ControlParams& p : params) {
      any.gravity = std::max(any.gravity, p.drive.model.gravity);
      any.coulomb = std::max(any.coulomb, p.drive.model.coulomb);
    }
    return any;
  }

  PlainStep<kScene, Lanes> law_;
  LanePlant<P> plant_;
  LaneEncoder encoder_;
  Lanes x_{};
};

}  // namespace farhand
