// Propagates a piecewise affine plant without step error; only rounding remains. A tick in which no guard can fall
// takes two small products with responses that were computed once per mode and length. That no guard can fall is proved
// from bounds of the flow, never sampled, so that a contact that closes and opens between two ticks is not missed. If
// the proof fails the length is halved, down to pieces so short that the solution is a power series. On the series the
// fall is located to rounding, the mode is changed, and the propagation goes on.
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
#include "common/integrate/affine_block.hpp"
#include "common/integrate/affine_series.hpp"
#include "common/integrate/matrix_exponential.hpp"
#include "common/integrate/method.hpp"

namespace farhand {

// T = long double is the reference for T = double. One object belongs to one plant: after start() only the held input
// of the plant may change. The settings that it uses are the number of events in an advance and the bound for
// divergence.
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
    x_ = State{}, t_ = base_ = t;
    whole_ = false, pieces_ = 0;
    if (!good(x) || !std::isfinite(t_)) return diverge();
    x_ = x;
    enter(plant);
  }

  // Advances exactly to t1; has no effect unless t1 is later than time().
  void advance(const P& plant, double t1) noexcept {
    if (!tick(plant, t1)) walk(plant, t1);
  }

  // Sets the state to x at t, which must be in the same mode and piece of the forcing.
  void place(double t, const State& x) noexcept {
    x_ = x, t_ = base_ = t;
    whole_ = false, pieces_ = 0;
  }

  const State& state() const noexcept { return x_; }
  Mode mode() const noexcept { return mode_; }
  double time() const noexcept { return t_; }
  const IntegratorCounters& counters() const noexcept { return counters_; }
  IntegratorStatus status() const noexcept { return status_; }

  // State at any time within the last advance (after more than kPieces - 1 events: within its last kPieces pieces), as
  // exact as at its end.
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
  static constexpr std::size_t kNone = 0;  // blocks_[0] is never used
  static constexpr std::size_t kBlocks = 40, kRates = 16, kPieces = 8;
  static constexpr int kMaxSeries = 100'000;  // per advance; then it ends as chattering does
  using Block = AffineBlock<P, T>;
  using Key = typename Block::Key;
  using Guards = typename Block::Guards;
  using Flow = AffineFlow<T, kStates>;

  // A smooth piece of the last advance, for at(). The forcing counts from the start of the piece.
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
    unrolled<kStates>([&](auto i) { all = all && std::fabs(x[i]) <= bound_; });  // false for NaN
    return all;
  }
  void diverge() noexcept {
    status_ = IntegratorStatus::kDiverged;
    current_ = kNone;
  }

  // Crosses a block if it is proved to lie within the mode; else has no effect. `since` counts from forcing_.begin.
  template <bool kLenient>
  bool cross(const Block& block, const Guards& guards, const State& b, T since, T late) noexcept {
    if (!unforced_) return cross_forced<kLenient>(block, guards, b, since, late);
    const T r = forcing_.polynomial[0];
    const State z = block.slope(b, r, x_);
    if (!block.clear_at_once(x_, z, T(0)) && !block.template clear<kLenient>(guards, x_, z, r, T(0))) return false;
    return move(sum(x_, change(block.response, z, late)));
  }
  template <bool kLenient>
  [[gnu::noinline]] bool cross_forced(const Block& block, const Guards& guards, const State& b, T since,
                                      T late) noexcept {
    const Forcing<T> forcing = forcing_.later(since);
    const T r = forcing.polynomial[0] + forcing.cosine;
    const State z = block.slope(b, r, x_);
    const auto pushed = push(block.response, forcing);
    if (!block.clear_at_once(x_, z, pushed.swing) && !block.template clear<kLenient>(guards, x_, z, r, pushed.swing))
      return false;
    const State driven = late == 0 ? pushed.state : sum(pushed.state, late_push(block.A, block.e, pushed, late));
    return move(sum(x_, sum(change(block.response, z, late), driven)));
  }
  bool move(const State& y) noexcept {
    if (!good(y)) return false;
    x_ = y;
    ++counters_.steps;
    return true;
  }

  // Makes the whole advance as one block, if there is a block of this length.
  bool tick(const P& plant, double t1) noexcept {
    const Key& key = keys_[current_];
    const T late = (static_cast<T>(t1) - static_cast<T>(t_)) - key.length;
    if (!(std::fabs(late) <= key.slack && t1 < next_break_)) return false;
    const Block& block = blocks_[current_];
    const State b = block.offset(plant, mode_);
    const State before = x_;
    if (!cross<false>(block, block.guards_now(plant, mode_), b, static_cast<T>(t_) - forcing_.begin, late))
      return false;
    from_ = before, b_ = b, base_ = t_, whole_ = true;
    t_ = t1;
    return true;
  }
  // Begins a smooth piece at t_.
  void enter(const P& plant) noexcept {
    mode_ = plant.mode_at(t_, rounded(x_));
    forcing_ = plant.template forcing<T>(t_);
    unforced_ = forcing_.constant();
    next_break_ = plant.next_break(t_);
    if (!(next_break_ > t_)) next_break_ = std::numeric_limits<double>::infinity();
    current_ = kNone;
  }
  T omega() const noexcept { return forcing_.sine != 0 || forcing_.cosine != 0 ? forcing_.omega : T(0); }

  // Makes the block of this length current if it exists, or if the same length is requested for the second time.
  bool select(const P& plant, T length) noexcept {
    current_ = kNone;
    for (std::size_t i = 1; i <= filled_; ++i) {
      const Key& key = keys_[i];
      if (key.mode == mode_ && std::fabs(length - key.length) <= key.slack && key.omega == omega()) current_ = i;
    }
    if (current_ == kNone && std::fabs(length - asked_) <= T(1e-6) * length) current_ = fill(plant, length);
    asked_ = length;
    return current_ != kNone;
  }
  const Block& block_of(const P& plant, T length) noexcept {
    for (std::size_t i = 1; i <= filled_; ++i) {
      const Key& key = keys_[i];
      if (key.mode == mode_ && length == key.length && key.omega == omega()) return blocks_[i];
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
  std::array<Key, kBlocks> keys_{};
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
  if (filled_ + 1 < kBlocks) {
    oldest_ = ++filled_;
  } else {
    oldest_ = oldest_ % (kBlocks - 1) + 1;
  }
  keys_[oldest_] = blocks_[oldest_].fill(plant, mode_, omega(), length);
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
  if (!(t1 > t_)) return;
  if (!std::isfinite(t1)) return diverge();
  if (status_ != IntegratorStatus::kDiverged) {
    if (select(plant, static_cast<T>(t1) - static_cast<T>(t_)) && tick(plant, t1)) return;
    base_ = t_, whole_ = false, pieces_ = 0;
    Budget budget{max_events_, status_ == IntegratorStatus::kOk ? kMaxSeries : kMaxSeries / 1000};
    while (t_ < t1) {
      const double stop = std::fmin(t1, next_break_);
      if (!walk_smoothly(plant, static_cast<T>(stop) - static_cast<T>(t_), budget)) {
        diverge();
        break;
      }
      t_ = stop;
      if (stop == next_break_) enter(plant);
    }
  }
  t_ = t1;  // after divergence only the time goes on
}

// Advances through all events up to `length` after t_, between two breaks of the forcing.
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
    int largest = fastest > 0 ? 2 - std::ilogb(fastest)
                              : 0;  // binary exponent of the largest block worth a trial: small after an event
    bool same_mode = true;
    while (rest > 0 && same_mode) {
      const T since = begun + (length - rest);
      if (fastest * rest > 4) {
        int exponent = std::min(std::ilogb(rest), largest);
        bool crossed = false;
        for (; !crossed && std::ldexp(fastest, exponent) > 1; exponent -= !crossed) {
          const Block& block = block_of(plant, std::ldexp(T(1), exponent));
          crossed = cross<true>(block, guards, flow.b, since, T(0));
        }
        largest = exponent + 1;
        if (crossed) {
          rest -= std::ldexp(T(1), exponent);
          continue;
        }
      }
      const T step = fastest * rest > T(1.0001) ? 1 / fastest : rest;
      const AffineSeries<T, kStates> series(flow, forcing_.later(since), x_, fastest, step);
      if (!good(series.at(1))) return false;
      T tau = 1;
      std::size_t fallen = kGuards;
      for (std::size_t i = 0; i < kGuards; ++i) {
        const T fall = series.first_fall(guards[i]);
        if (fall >= 0 && (fall < tau || fallen == kGuards)) tau = fall, fallen = i;
      }
      x_ = series.at(tau);
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
  const auto response = respond(flow.A, flow.e, piece.forcing.omega, s);
  const State z = slope(flow.A, flow.b, flow.e, piece.forcing.polynomial[0] + piece.forcing.cosine, piece.x);
  return sum(piece.x, sum(change(response, z, T(0)), push(response, piece.forcing).state));
}

}  // namespace farhand
