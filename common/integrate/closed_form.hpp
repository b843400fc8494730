// Propagates a piecewise affine plant without step error: what is left is rounding. A tick in which no guard can fall is
// two small products with responses that were computed once per mode and length. That no guard can fall is proved from
// bounds of the flow, never sampled, so a contact that closes and opens between two ticks is not missed. Where the proof
// fails, the way is halved, down to pieces so short that the solution is a power series; on it the fall is located to
// rounding, the mode is changed and the way goes on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/integrate/affine.hpp"
#include "common/integrate/affine_series.hpp"
#include "common/integrate/matrix_exponential.hpp"
#include "common/integrate/method.hpp"

namespace farhand {

// T = long double is the reference for T = double. One object follows one plant: between start and start, only the
// held input of the plant may change. Of the settings it needs how many events an advance may have and what counts as
// diverged.
template <AffinePlant P, class T = double>
class ClosedForm {
 public:
  static constexpr std::size_t kStates = P::kStates;
  static constexpr std::size_t kGuards = P::kGuards;
  using State = std::array<T, kStates>;

  explicit ClosedForm(const IntegratorSettings& settings = {})
      : max_events_(settings.max_events), bound_(static_cast<T>(settings.bound)), blocks_(kBlocks) {
    check(settings);
  }
  // Throws std::invalid_argument with the reason if the plant is not piecewise affine.
  ClosedForm(const IntegratorSettings& settings, const P& plant, double t, const State& x) : ClosedForm(settings) {
    start(plant, t, x);
  }

  // Throws as above.
  void start(const P& plant, double t, const State& x) {
    if (const char* reason = plant.not_affine())
      throw std::invalid_argument(std::string("the closed form cannot propagate this plant: ") + reason);
    filled_ = oldest_ = current_ = kNone;
    rates_known_ = 0;
    asked_ = 0;
    counters_ = {};
    status_ = IntegratorStatus::kOk;
    x_ = x, t_ = base_ = t;
    whole_ = false, pieces_ = 0;
    if (!good(x_) || !std::isfinite(t_)) return diverge();
    enter(plant);
  }

  // Exactly to t1. Nothing happens unless t1 is later than time().
  void advance(const P& plant, double t1) noexcept {
    if (!tick(plant, t1)) walk(plant, t1);
  }

  // The state has come to x at t some other way, without leaving the mode or the piece of the forcing.
  void move(double t, const State& x) noexcept {
    x_ = x, t_ = base_ = t;
    whole_ = false, pieces_ = 0;
  }

  const State& state() const noexcept { return x_; }
  Mode mode() const noexcept { return mode_; }
  double time() const noexcept { return t_; }
  const IntegratorCounters& counters() const noexcept { return counters_; }
  IntegratorStatus status() const noexcept { return status_; }

  // Anywhere in the last advance (if it had more than kPieces - 1 events: in its last kPieces pieces), as exact as its
  // end.
  State at(double t) const noexcept {
    if (status_ == IntegratorStatus::kDiverged || !(t < t_)) return x_;
    const T s = std::max(static_cast<T>(t) - static_cast<T>(base_), T(0));
    if (whole_) {
      const Block& block = blocks_[current_];
      return flown({{block.A, b_, block.e}, forcing_.later(static_cast<T>(base_) - forcing_.begin), from_, 0}, s);
    }
    const Piece* piece = nullptr;
    for (std::size_t i = pieces_ > kPieces ? pieces_ - kPieces : 0; i < pieces_; ++i) {
      if (piece == nullptr || last_[i % kPieces].offset <= s) piece = &last_[i % kPieces];
    }
    return piece != nullptr ? flown(*piece, std::max(s - piece->offset, T(0))) : x_;
  }

 private:
  static constexpr std::size_t kNone = 0;  // blocks_[0] is never of use
  static constexpr std::size_t kBlocks = 40, kRates = 16, kPieces = 8;
  static constexpr int kMaxSeries = 1'000'000;  // per advance; then it ends as chattering does
  using Flow = AffineFlow<T, kStates>;
  using Guards = std::array<AffineGuard<T, kStates>, kGuards>;
  using Form = AffineForm<T, kStates>;
  using Response = AffineResponse<T, kStates>;

  // How far a form can move from its value at the start of a block: by reach |x'| + drift |r - r(0)|.
  struct Bound {
    State reach{};
    T drift = 0;
  };
  // All that is needed to cross one length of time in one mode.
  struct Block {
    Mode mode = 0;
    T omega = 0;
    T slack = -1;  // the length may be off by this; negative: of no use
    SquareMatrix<T, kStates> A{};
    State e{};
    Response response{};
    Guards guards{};
    std::array<std::array<Bound, 2>, kGuards> bounds{};
  };
  // What at() needs: a smooth piece of the last advance. The forcing counts from its start.
  struct Piece {
    Flow flow{};
    Forcing<T> forcing{};
    State x{};
    T offset = 0;  // s after base_
  };
  struct Rate {
    Mode mode = 0;
    T value = 0;
  };
  struct Budget {
    int events, series;
  };

  static std::array<double, kStates> rounded(const State& x) noexcept {
    std::array<double, kStates> y{};
    for (std::size_t i = 0; i < kStates; ++i) y[i] = static_cast<double>(x[i]);
    return y;
  }
  bool good(const State& x) const noexcept {
    bool all = true;
    for (const T value : x) all = all && std::fabs(value) <= bound_;  // false for NaN
    return all;
  }
  void diverge() noexcept {
    status_ = IntegratorStatus::kDiverged;
    current_ = kNone;
  }

  static State slope(const SquareMatrix<T, kStates>& A, const State& b, const State& e, T r, const State& x) noexcept {
    State z = b;
    for (std::size_t i = 0; i < kStates; ++i) {
      z[i] += e[i] * r;
      for (std::size_t j = 0; j < kStates; ++j) z[i] += A[i][j] * x[j];
    }
    return z;
  }

  // Of the forcing from its start on, over a length. What it adds to the state, and how far it moves.
  struct Push {
    State state{};
    T swing = 0;
  };
  static Push push(const Response& response, const Forcing<T>& r) noexcept {
    Push out;
    T power = 1;
    for (std::size_t j = 1; j <= 5; ++j) {
      power *= response.length;
      out.swing += std::fabs(r.polynomial[j]) * power;
      for (std::size_t i = 0; i < kStates; ++i) out.state[i] += response.power[j - 1][i] * r.polynomial[j];
    }
    if (r.sine != 0 || r.cosine != 0) {
      const T turn = std::min(std::fabs(r.omega) * response.length, T(2));
      out.swing += turn * (std::fabs(r.sine) + std::fabs(r.cosine));
      for (std::size_t i = 0; i < kStates; ++i)
        out.state[i] += response.sine[i] * r.sine + response.cosine[i] * r.cosine;
    }
    return out;
  }
  // The state after length + late; `late` is of first order only.
  static State apply(const Response& response, const State& x, const State& z, const State& pushed, T late) noexcept {
    State y = x;
    for (std::size_t i = 0; i < kStates; ++i) {
      T change = pushed[i] + late * z[i];
      for (std::size_t j = 0; j < kStates; ++j) change += (response.Psi[i][j] + late * response.D[i][j]) * z[j];
      y[i] += change;
    }
    return y;
  }

  // No guard can fall in this block. `rounding` lets a state rest on a border.
  static bool clear(const Block& block, const Guards& guards, const State& x, const State& z, T r, T swing,
                    T rounding) noexcept {
    using Kind = typename AffineGuard<T, kStates>::Kind;
    const auto stays = [&](const Form& form, const Bound& bound) {
      T left = form.d + form.h * r - bound.drift * swing;
      for (std::size_t i = 0; i < kStates; ++i) left += form.c[i] * x[i] - bound.reach[i] * std::fabs(z[i]);
      if (rounding > 0) {
        T size = std::fabs(form.d) + std::fabs(form.h * r);
        for (std::size_t i = 0; i < kStates; ++i) size += std::fabs(form.c[i] * x[i]);
        left += rounding * size;
      }
      return left > 0;  // false for NaN
    };
    for (std::size_t i = 0; i < kGuards; ++i) {
      const auto& guard = guards[i];
      const auto& bound = block.bounds[i];
      switch (guard.kind) {
        case Kind::kNever:
          continue;
        case Kind::kOne:
          if (!stays(guard.first, bound[0])) return false;
          continue;
        case Kind::kMax:
          if (!stays(guard.first, bound[0]) && !stays(guard.second, bound[1])) return false;
          continue;
        case Kind::kMin:
          if (!stays(guard.first, bound[0]) || !stays(guard.second, bound[1])) return false;
          continue;
      }
    }
    return true;
  }

  // Crosses a block if it is proved to lie within the mode; else nothing happens. `since` counts from forcing_.begin.
  bool cross(const Block& block, const Guards& guards, const State& b, T since, T late, T rounding) noexcept {
    const Response& response = block.response;
    State y;
    if (unforced_) {
      const T r = forcing_.polynomial[0];
      const State z = slope(block.A, b, block.e, r, x_);
      if (!clear(block, guards, x_, z, r, T(0), rounding)) return false;
      y = apply(response, x_, z, State{}, late);
    } else {
      const Forcing<T> forcing = forcing_.later(since);
      const T r = forcing.polynomial[0] + forcing.cosine;
      const State z = slope(block.A, b, block.e, r, x_);
      const Push pushed = push(response, forcing);
      if (!clear(block, guards, x_, z, r, pushed.swing, rounding)) return false;
      y = apply(response, x_, z, pushed.state, late);
    }
    if (!good(y)) return false;
    x_ = y;
    ++counters_.steps;
    return true;
  }

  // The whole advance as one block, if there is one of this length.
  bool tick(const P& plant, double t1) noexcept {
    const Block& block = blocks_[current_];
    const T late = (static_cast<T>(t1) - static_cast<T>(t_)) - block.response.length;
    if (!(std::fabs(late) <= block.slack && t1 < next_break_)) return false;
    const State b = plant.template flow<T>(mode_).b;
    const State before = x_;
    if (!cross(block, guards_in(plant, block), b, static_cast<T>(t_) - forcing_.begin, late, T(0))) return false;
    from_ = before, b_ = b, base_ = t_, whole_ = true;
    t_ = t1;
    return true;
  }
  decltype(auto) guards_in(const P& plant, const Block& block) const noexcept {
    if constexpr (requires { requires !P::kInputMovesGuards; }) {
      return (block.guards);
    } else {
      return plant.template guard_forms<T>(block.mode);
    }
  }

  // A smooth piece begins at t_.
  void enter(const P& plant) noexcept {
    mode_ = plant.mode_at(t_, rounded(x_));
    forcing_ = plant.template forcing<T>(t_);
    unforced_ = forcing_.constant();
    next_break_ = plant.next_break(t_);
    if (!(next_break_ > t_)) next_break_ = std::numeric_limits<double>::infinity();
    current_ = kNone;
  }
  T omega() const noexcept { return forcing_.sine != 0 || forcing_.cosine != 0 ? forcing_.omega : T(0); }

  // Makes the block of this length current if it exists, or if the same length is asked for a second time.
  bool select(const P& plant, T length) noexcept {
    current_ = kNone;
    for (std::size_t i = 1; i <= filled_; ++i) {
      const Block& block = blocks_[i];
      if (block.mode == mode_ && std::fabs(length - block.response.length) <= block.slack && block.omega == omega())
        current_ = i;
    }
    if (current_ == kNone && std::fabs(length - asked_) <= T(1e-6) * length) current_ = fill(plant, length);
    asked_ = length;
    return current_ != kNone;
  }
  const Block& block_of(const P& plant, T length) noexcept {
    for (std::size_t i = 1; i <= filled_; ++i) {
      const Block& block = blocks_[i];
      if (block.mode == mode_ && length == block.response.length && block.omega == omega()) return block;
    }
    return blocks_[fill(plant, length)];
  }
  std::size_t fill(const P& plant, T length) noexcept;
  T rate_of(const P& plant) noexcept;

  void walk(const P& plant, double t1) noexcept;
  bool walk_smoothly(const P& plant, T length, Budget& budget) noexcept;
  static State flown(const Piece& piece, T s) noexcept;

  int max_events_;
  T bound_;
  State x_{};
  double t_ = 0;
  Mode mode_ = 0;
  Forcing<T> forcing_{};
  bool unforced_ = true;
  double next_break_ = 0;
  std::vector<Block> blocks_;  // of fixed size
  std::size_t current_ = kNone, filled_ = kNone, oldest_ = kNone;
  std::array<Rate, kRates> rates_{};
  std::size_t rates_known_ = 0;
  T asked_ = 0;
  IntegratorStatus status_ = IntegratorStatus::kOk;
  IntegratorCounters counters_{};

  State from_{}, b_{};  // of the last advance, if it was one block
  double base_ = 0;     // where the last advance began
  bool whole_ = false;
  std::size_t pieces_ = 0;
  std::array<Piece, kPieces> last_{};
};

template <AffinePlant P, class T>
std::size_t ClosedForm<P, T>::fill(const P& plant, T length) noexcept {
  using W = Wide<T>;
  if (filled_ + 1 < kBlocks) {
    oldest_ = ++filled_;
  } else {
    oldest_ = oldest_ % (kBlocks - 1) + 1;
  }
  Block& block = blocks_[oldest_];
  const AffineFlow<W, kStates> flow = plant.template flow<W>(mode_);
  const W rate = fastest_rate_of(flow.A);
  const AffineResponse<W, kStates> wide = respond(flow.A, flow.e, static_cast<W>(omega()), static_cast<W>(length));
  block.mode = mode_;
  block.omega = omega();
  block.guards = plant.template guard_forms<T>(mode_);
  block.response.length = length;
  // Late is of first order: its square must not show.
  const T fastest = static_cast<T>(std::max(rate, std::fabs(static_cast<W>(block.omega))));
  block.slack = std::min(T(1e-6) * length, std::sqrt(std::numeric_limits<T>::epsilon()) / 8 / fastest);
  const auto narrow = [](const std::array<W, kStates>& from, State& to) {
    for (std::size_t i = 0; i < kStates; ++i) to[i] = static_cast<T>(from[i]);
  };
  for (std::size_t i = 0; i < kStates; ++i) {
    narrow(flow.A[i], block.A[i]);
    narrow(wide.D[i], block.response.D[i]);
    narrow(wide.Psi[i], block.response.Psi[i]);
  }
  for (std::size_t j = 0; j < 5; ++j) narrow(wide.power[j], block.response.power[j]);
  narrow(wide.sine, block.response.sine);
  narrow(wide.cosine, block.response.cosine);
  narrow(flow.e, block.e);
  // A millionth more covers their rounding, and the block being late.
  const auto bound_of = [&wide, &flow](const Form& form) {
    Bound bound;
    W drift = 0;
    for (std::size_t j = 0; j < kStates; ++j) {
      W reach = 0;
      for (std::size_t i = 0; i < kStates; ++i) {
        const W slope = std::fabs(static_cast<W>(form.c[i]));
        reach += slope * wide.reach[i][j];
        drift += slope * wide.travel[i][j] * std::fabs(flow.e[j]);
      }
      bound.reach[j] = static_cast<T>(reach * W(1.000001));
    }
    bound.drift = static_cast<T>((drift + std::fabs(static_cast<W>(form.h))) * W(1.000001));
    return bound;
  };
  for (std::size_t g = 0; g < kGuards; ++g)
    block.bounds[g] = {bound_of(block.guards[g].first), bound_of(block.guards[g].second)};
  ++counters_.jacobians;
  return oldest_;
}

template <AffinePlant P, class T>
T ClosedForm<P, T>::rate_of(const P& plant) noexcept {
  for (std::size_t i = 0; i < std::min(rates_known_, kRates); ++i) {
    if (rates_[i].mode == mode_) return rates_[i].value;
  }
  const T rate = fastest_rate_of(plant.template flow<T>(mode_).A);
  rates_[rates_known_++ % kRates] = {mode_, rate};
  return rate;
}

template <AffinePlant P, class T>
void ClosedForm<P, T>::walk(const P& plant, double t1) noexcept {
  if (!(t1 > t_) || status_ == IntegratorStatus::kDiverged) return;
  if (!std::isfinite(t1)) return diverge();
  if (select(plant, static_cast<T>(t1) - static_cast<T>(t_)) && tick(plant, t1)) return;
  base_ = t_, whole_ = false, pieces_ = 0;
  Budget budget{max_events_, kMaxSeries};
  while (t_ < t1) {
    const double stop = std::fmin(t1, next_break_);
    if (!walk_smoothly(plant, static_cast<T>(stop) - static_cast<T>(t_), budget)) return diverge();
    t_ = stop;
    if (stop == next_break_) enter(plant);
  }
}

// Through all events up to `length` after t_, between two breaks of the forcing.
template <AffinePlant P, class T>
bool ClosedForm<P, T>::walk_smoothly(const P& plant, T length, Budget& budget) noexcept {
  const T begun = static_cast<T>(t_) - forcing_.begin;
  T rest = length;
  while (rest > 0) {
    const Flow flow = plant.template flow<T>(mode_);
    const Guards all = plant.template guard_forms<T>(mode_);
    const bool watched = budget.events > 0 && budget.series > 0;
    if (!watched) status_ = IntegratorStatus::kChattering;
    const Guards guards = watched ? all : Guards{};
    const T fastest = std::max(rate_of(plant), std::fabs(omega()));
    if (!(fastest * length < T(1e15))) return false;
    last_[pieces_++ % kPieces] = {flow, forcing_.later(begun + (length - rest)), x_,
                                  (static_cast<T>(t_) - static_cast<T>(base_)) + (length - rest)};
    int largest = std::numeric_limits<int>::max();  // binary exponent of the largest block worth a trial
    bool same_mode = true;
    while (rest > 0 && same_mode) {
      const T since = begun + (length - rest);
      if (fastest * rest > 4) {
        int exponent = std::min(std::ilogb(rest), largest);
        bool crossed = false;
        for (; !crossed && std::ldexp(fastest, exponent) > 1; exponent -= !crossed) {
          const Block& block = block_of(plant, std::ldexp(T(1), exponent));
          crossed = cross(block, guards, flow.b, since, T(0), std::numeric_limits<T>::epsilon());
        }
        largest = exponent + 1;
        if (crossed) {
          rest -= std::ldexp(T(1), exponent);
          continue;
        }
      }
      const T step = fastest * rest > T(1.0001) ? 1 / fastest : rest;
      const AffineSeries<T, kStates> series(flow, forcing_.later(since), x_, fastest, step);
      T tau = 1;
      std::size_t fallen = kGuards;
      for (std::size_t i = 0; i < kGuards; ++i) {
        const T fall = series.first_fall(guards[i]);
        if (fall >= 0 && (fall < tau || fallen == kGuards)) tau = fall, fallen = i;
      }
      const State y = series.at(tau);
      if (!good(y)) return false;
      x_ = y;
      ++counters_.steps;
      if (fallen == kGuards) {
        rest -= step;
        same_mode = --budget.series != 0;
        continue;
      }
      rest -= tau * step;
      std::array<double, kStates> reset = rounded(x_);
      const std::array<double, kStates> before = reset;
      mode_ = plant.cross(mode_, fallen, t_ + static_cast<double>(length - rest), reset);
      for (std::size_t i = 0; i < kStates; ++i) {
        if (reset[i] != before[i]) x_[i] = static_cast<T>(reset[i]);
      }
      if (!good(x_)) return false;
      --budget.events;
      ++counters_.events;
      current_ = kNone;
      same_mode = false;
    }
  }
  return true;
}

template <AffinePlant P, class T>
typename ClosedForm<P, T>::State ClosedForm<P, T>::flown(const Piece& piece, T s) noexcept {
  const Flow& flow = piece.flow;
  const T fastest = std::max(fastest_rate_of(flow.A), std::fabs(piece.forcing.omega));
  if (fastest * s <= 1) return AffineSeries<T, kStates>(flow, piece.forcing, piece.x, fastest, s).at(1);
  const Response response = respond(flow.A, flow.e, piece.forcing.omega, s);
  const State z = slope(flow.A, flow.b, flow.e, piece.forcing.polynomial[0] + piece.forcing.cosine, piece.x);
  return apply(response, piece.x, z, push(response, piece.forcing).state, T(0));
}

}  // namespace farhand
