// Applies a method to a piecewise smooth plant: whole steps between the breaks of its inputs, and a step of solved
// length at every guard that falls below zero. This step ends on the guard, so that the method keeps its order. The
// mode then changes and the next step begins there.
//
// An event step ends where its guard is just below zero. If the state that plant.cross leaves has a guard below zero in
// the next mode, that guard is crossed at the same instant. Events that never end (a plant whose modes contradict each
// other, a ball that bounces ever lower) are ended by max_events.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/integrate/crossing.hpp"
#include "common/integrate/step_work.hpp"

namespace farhand {

template <class Scheme, Plant P>
class Integrator {
 public:
  using State = typename P::State;

  // Throws std::invalid_argument.
  explicit Integrator(const IntegratorSettings& settings) : settings_(settings), next_step_(settings.max_step) {
    check(settings);
  }

  void start(const P& plant, double t, const State& x) noexcept {
    status_ = IntegratorStatus::kOk;
    work_.counters = {};
    next_step_ = settings_.max_step;
    last_error_ = 1e-4;
    length_ = 0;
    t_ = t;
    x_ = State{};
    if (!std::isfinite(t) || !within_bounds(x)) return diverge();
    x_ = x;
    mode_ = plant.mode_at(t_, x_);
  }

  // Advances exactly to t1; has no effect unless t1 is later. Held inputs of the plant may have changed since the last
  // advance.
  void advance(const P& plant, double t1) noexcept {
    if (!(t1 > t_)) return;
    if (!std::isfinite(t1)) return diverge();
    events_left_ = settings_.max_events;
    frozen_ = false;
    work_.moved();
    while (t_ < t1 && status_ != IntegratorStatus::kDiverged) {
      double stop = plant.next_break(t_);
      if (!(stop > t_)) stop = std::numeric_limits<double>::infinity();
      if (stop > t1) {
        run(plant, t1);
      } else {
        // Slightly before the break, so that no stage is evaluated after it.
        run(plant, stop - 4.0 * std::numeric_limits<double>::epsilon() * std::fabs(stop));
        if (status_ == IntegratorStatus::kDiverged) break;
        t_ = stop;
        if (!frozen_) mode_ = plant.mode_at(t_, x_);
        work_.moved();
      }
    }
    t_ = t1;
  }

  const State& state() const noexcept { return x_; }
  Mode mode() const noexcept { return mode_; }
  double time() const noexcept { return t_; }
  IntegratorStatus status() const noexcept { return status_; }
  const IntegratorCounters& counters() const noexcept { return work_.counters; }

  // State at t within the last step, as exact as the method; for earlier times its beginning, for later ones its end.
  State at(double t) const noexcept {
    if (!(t < t_) || !(length_ > 0)) return x_;
    const double theta = (t - begin_) / length_;
    return theta > 0 ? Scheme::template dense<P>(from_, length_, to_, work_).at(theta) : from_;
  }

 private:
  static constexpr bool kHasGuards = P::kGuards > 0;
  using Guards = std::array<double, P::kGuards>;
  static constexpr std::size_t kNone = P::kGuards;
  static constexpr int kMaxHalvings = 30;
  static constexpr int kMaxSearch = 80;
  static constexpr double kSearchTolerance = 1e-15;  // of the length of the step
  static constexpr double kShortest = 1e-6;          // shortest step of the adaptive pair, in max_step

  bool within_bounds(const State& x) const noexcept {
    return std::all_of(x.begin(), x.end(), [this](double v) { return std::fabs(v) <= settings_.bound; });
  }
  void diverge() noexcept {
    status_ = IntegratorStatus::kDiverged;
    length_ = 0;
  }

  // Runs over a stretch without breaks, in steps of equal length, except for those that events divide.
  void run(const P& plant, double end) noexcept {
    settle(plant);
    if constexpr (Scheme::kEmbedded) {
      while (t_ < end && status_ != IntegratorStatus::kDiverged) one_step(plant, end);
    } else {
      const double begin = t_;
      const double steps = std::fmax(1.0, std::ceil((end - begin) / settings_.max_step * (1.0 - 1e-6)));
      const double h = (end - begin) / steps;
      for (double i = 1; i <= steps; ++i) {
        const double target = i < steps ? begin + i * h : end;
        while (t_ < target && status_ != IntegratorStatus::kDiverged) one_step(plant, target);
      }
    }
  }

  // One accepted step, up to `target` or shorter.
  void one_step(const P& plant, double target) noexcept {
    State y;
    double h = target - t_;
    if (!attempt(plant, h, y)) return diverge();
    if (!within_bounds(y)) return diverge();
    bool event = false;
    std::size_t guard = kNone;
    if constexpr (kHasGuards) {
      if (frozen_ || keeps_clear(plant, x_, y, h)) {
        guards_known_ = before_known_ = false;
      } else {
        if (!guards_known_) guards_ = plant.guards(mode_, t_, x_);
        const Guards after = plant.guards(mode_, t_ + h, y);
        if (!far_from_borders(after)) guard = find_crossing(plant, h, y, after);
        event = guard != kNone;
        if (event && !within_bounds(y)) return diverge();
        before_ = guards_;
        guards_ = after;
        before_known_ = guards_known_ && h == target - t_;
        guards_known_ = true;
      }
    }
    ++work_.counters.steps;
    begin_ = t_;
    length_ = h;
    from_ = x_;
    to_ = x_ = y;
    t_ = h == target - t_ ? target : t_ + h;
    if constexpr (Scheme::kEmbedded) {
      work_.slope = work_.k[6];
      work_.slope_known = true;
    } else {
      work_.moved();
    }
    if (event) {
      cross(plant, guard);
      settle(plant);
    }
  }

  // Takes a step that the method accepts, of length h or shorter.
  bool attempt(const P& plant, double& h, State& y) noexcept {
    if constexpr (Scheme::kEmbedded) {
      return attempt_with_error(plant, h, y);
    } else {
      for (int halvings = 0; halvings <= kMaxHalvings; ++halvings, h *= 0.5) {
        if (Scheme::step(plant, mode_, t_, x_, h, y, work_)) return true;
        ++work_.counters.rejected;
      }
      return false;
    }
  }

  // The step follows from the error by a proportional-integral rule (Gustafsson; Hairer, Wanner: Solving Ordinary
  // Differential Equations II, IV.2). The proposal outlives a step that was cut short by the end of an advance.
  bool attempt_with_error(const P& plant, double& h, State& y) noexcept {
    constexpr double kBeta = 0.04, kExponent = 0.2 - 0.75 * kBeta, kHopeless = 1e30;
    const double rest = h;
    const double shortest = kShortest * settings_.max_step;
    double wanted = next_step_;
    for (;;) {
      h = wanted < 0.999 * rest ? wanted : rest;
      if (!Scheme::step(plant, mode_, t_, x_, h, y, work_)) return false;
      double error = 0;
      for (std::size_t i = 0; i < P::kStates; ++i) {
        const double scale = settings_.atol + settings_.rtol * std::fmax(std::fabs(x_[i]), std::fabs(y[i]));
        const double part = work_.error[i] == 0 ? 0.0 : std::fabs(work_.error[i]) / scale;
        error = part < kHopeless ? std::fmax(error, part) : kHopeless;
      }
      const double factor = std::pow(error, kExponent) / std::pow(last_error_, kBeta) / 0.9;
      if (error <= 1.0 || wanted <= shortest) {
        if (error > 1.0) ++work_.counters.unmet;
        const double proposal = std::min(settings_.max_step, h / std::clamp(factor, 0.1, 5.0));
        next_step_ = std::max(shortest, h < wanted ? std::max(wanted, proposal) : proposal);
        last_error_ = std::fmax(error, 1e-4);
        return true;
      }
      ++work_.counters.rejected;
      wanted = std::max(shortest, h / std::clamp(std::pow(error, kExponent) / 0.9, 1.0, 10.0));
    }
  }

  // A step of some length from the present state, and the guards at its end.
  struct Trial {
    double length;
    State y;
    Guards g;
  };
  bool take(const P& plant, double length, Trial& trial) noexcept {
    trial.length = length;
    if (!Scheme::step(plant, mode_, t_, x_, length, trial.y, work_)) return false;
    trial.g = plant.guards(mode_, t_ + length, trial.y);
    return true;
  }
  static std::size_t first_negative(const Guards& g) noexcept {
    return static_cast<std::size_t>(std::find_if(g.begin(), g.end(), [](double v) { return v < 0; }) - g.begin());
  }

  // A plant may know, at less cost than by its guards, that no border is near a step.
  bool keeps_clear(const P& plant, const State& from, const State& to, double h) const noexcept {
    if constexpr (requires { plant.keeps_clear(mode_, from, to, h); }) {
      return !Scheme::kEmbedded && plant.keeps_clear(mode_, from, to, h);
    } else {
      return false;
    }
  }

  // True if in this step and the last one, of equal length and smoothness, no guard moved by a quarter of its value:
  // then no guard fell to zero and rose again within the step.
  bool far_from_borders(const Guards& after) const noexcept {
    if (Scheme::kEmbedded || !before_known_) return false;
    for (std::size_t i = 0; i < P::kGuards; ++i) {
      const double enough = 4.0 * (std::fabs(after[i] - guards_[i]) + std::fabs(guards_[i] - before_[i]));
      if (!(after[i] > enough) || !(guards_[i] > enough)) return false;
    }
    return true;
  }

  // The guard that falls below zero first within the step of length h to y, or kNone. If there is one, h and y are
  // shortened to the step that ends on it.
  std::size_t find_crossing(const P& plant, double& h, State& y, const Guards& after) noexcept {
    const auto path = Scheme::template dense<P>(x_, h, y, work_);
    const Guards third = plant.guards(mode_, t_ + h / 3.0, path.at(1.0 / 3.0));
    const Guards two_thirds = plant.guards(mode_, t_ + h * 2.0 / 3.0, path.at(2.0 / 3.0));
    std::array<GuardCubic, P::kGuards> cubic;
    std::array<double, P::kGuards> dip;  // where a guard may be below zero though it is not at the end
    bool suspected = false;
    for (std::size_t i = 0; i < P::kGuards; ++i) {
      cubic[i] = GuardCubic::through(guards_[i], third[i], two_thirds[i], after[i]);
      dip[i] = after[i] < 0 ? 0.0 : cubic[i].dip() * h;
      suspected = suspected || after[i] < 0 || dip[i] > 0;
    }
    if (!suspected) return kNone;

    Trial high{h, y, after};
    for (std::size_t i = 0; i < P::kGuards; ++i) {
      Trial low;
      if (dip[i] > 0 && dip[i] < high.length && take(plant, dip[i], low) && low.g[i] < 0) high = low;
    }

    std::size_t guard = kNone;
    double first = 2.0;
    for (std::size_t i = 0; i < P::kGuards; ++i) {
      if (!(high.g[i] < 0)) continue;
      const double root = cubic[i].root_before(high.length / h);
      if (root < first) first = root, guard = i;
    }
    if (guard != kNone)
      guard = search(plant, Trial{0.0, x_, guards_}, high, guard, first * h, cubic[guard].slope(first) / h);
    h = high.length;
    Scheme::step(plant, mode_, t_, x_, h, y, work_);  // the stages that are kept must belong to the accepted step
    return guard;
  }

  // Narrows the bracket around the first crossing by trial steps (secant method). `high` ends just behind the crossing.
  std::size_t search(const P& plant, Trial low, Trial& high, std::size_t guard, double guess, double slope) noexcept {
    const double tolerance = kSearchTolerance * high.length;
    double push = 0.5 * tolerance;
    bool was_negative = true;
    for (int i = 0; i < kMaxSearch && high.length - low.length > tolerance; ++i) {
      const double middle = 0.5 * (low.length + high.length);
      // Every third trial halves, once there have been more than a smooth guard needs.
      if (!(guess >= 0) || (i > 8 && i % 3 == 0)) guess = middle;
      if (guess <= low.length + push) guess = std::min(low.length + push, middle);
      if (guess >= high.length - push) guess = std::max(high.length - push, middle);
      Trial now;
      if (!take(plant, guess, now)) {
        guess = 0.5 * (low.length + guess);
        continue;
      }
      const std::size_t negative = first_negative(now.g);
      if (negative != kNone && !(now.g[guard] < 0)) {  // another guard falls earlier
        guard = negative;
        slope = (now.g[guard] - low.g[guard]) / (now.length - low.length);
      } else {
        const Trial& other = std::fabs(now.length - low.length) < std::fabs(high.length - now.length) ? low : high;
        const double secant = (now.g[guard] - other.g[guard]) / (now.length - other.length);
        if (i > 0 && std::isfinite(secant)) slope = secant;
      }
      guess = slope < 0 ? now.length - now.g[guard] / slope : middle;
      const bool is_negative = negative != kNone;
      push = is_negative == was_negative ? 2.0 * push : 0.5 * tolerance;
      was_negative = is_negative;
      (is_negative ? high : low) = now;
    }
    return guard;
  }

  void cross(const P& plant, std::size_t guard) noexcept {
    if (events_left_ == 0) {
      frozen_ = true;
      if (status_ == IntegratorStatus::kOk) status_ = IntegratorStatus::kChattering;
      return;
    }
    --events_left_;
    ++work_.counters.events;
    State x = x_;
    mode_ = plant.cross(mode_, guard, t_, x);
    work_.moved();
    if (!within_bounds(x)) return diverge();
    x_ = x;
  }

  // Crosses guards that are below zero at this instant, because an input jumped or because two guards fell together.
  void settle(const P& plant) noexcept {
    if constexpr (kHasGuards) {
      before_known_ = guards_known_ = false;
      if (keeps_clear(plant, x_, x_, 0.0)) return;
      while (!frozen_ && status_ != IntegratorStatus::kDiverged) {
        guards_ = plant.guards(mode_, t_, x_);
        guards_known_ = true;
        const std::size_t guard = first_negative(guards_);
        if (guard == kNone) return;
        cross(plant, guard);
      }
    }
  }

  IntegratorSettings settings_;
  Work<P> work_{};
  State x_{}, from_{}, to_{};
  Guards guards_{}, before_{};             // here, and where the last step began
  double t_ = 0, begin_ = 0, length_ = 0;  // begin and length of the last step, from_ to to_
  double next_step_, last_error_ = 1e-4;   // of the adaptive pair
  Mode mode_ = 0;
  int events_left_ = 0;
  bool frozen_ = false;  // events of this advance are used up
  bool guards_known_ = false, before_known_ = false;
  IntegratorStatus status_ = IntegratorStatus::kOk;
};

}  // namespace farhand
