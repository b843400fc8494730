// A plant alone under one method, over ticks of held input, compared with its second computation, with its energy.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "common/integrate/closed_form.hpp"
#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "common/integrate/stiffness.hpp"
#include "netem/lab/extreme_probe.hpp"
#include "netem/lab/metered.hpp"

namespace farhand::extreme {

template <Plant P>
struct PlantPlan {
  typename P::Params params;
  typename P::State start{};
  std::function<double(int tick)> input = [](int) { return 0.0; };
  double tick_s = 1e-3;
  int ticks = 200;
  std::vector<double> corners;  // angles where a power has a kink within a mode: the ends of springs
  IntegratorSettings settings{.max_step = 0.5e-3, .rtol = 1e-12, .atol = 1e-14, .max_events = 100'000};
};
// x of the second computation at the end of each tick, called in order.
using SecondWay = std::function<double(int tick, double input)>;

// Results of a plant, for cases and for the table of methods.
struct PlantRecord {
  double error = 0;      // largest |x - second way| at a tick
  double gained = 0;     // largest energy gained without source, over the exchanged energy
  double imbalance = 0;  // the same, either sign
  IntegratorStatus status = IntegratorStatus::kOk;
  IntegratorCounters counters;
  bool finite = true;
};

// Exchanged energy, for all runs: largest stored energy, and energy in and out.
class Turnover {
 public:
  // balance: supplied less dissipated so far; work: of the held torque so far, exact whatever the method.
  void add(double stored, double balance, double work) noexcept {
    if (!begun_) begun_ = true, first_ = stored;
    const double off = stored - first_ - balance;
    most_ = std::fmax(most_, std::fmax(std::fabs(stored), std::fabs(balance)));
    gained_ = std::fmax(gained_, stored - first_ - work);
    worst_ = std::fmax(worst_, std::fabs(off));
    if (!std::isfinite(off)) gained_ = worst_ = HUGE_VAL;
  }
  double most() const noexcept { return most_; }
  double gained() const noexcept { return gained_ / std::fmax(most_, 1e-300); }
  double imbalance() const noexcept { return worst_ / std::fmax(most_, 1e-300); }

 private:
  bool begun_ = false;
  double first_ = 0, most_ = 0, gained_ = 0, worst_ = 0;
};

template <class Scheme, Plant P>
PlantRecord run_stepping(const PlantPlan<P>& plan, const SecondWay& second_way) {
  Metered<P> metered{P(plan.params)};
  Integrator<Scheme, Metered<P>> solver(plan.settings);
  metered.hold(plan.input(0));
  solver.start(metered, 0.0, Metered<P>::with(plan.start, 0.0, 0.0));
  PlantRecord record;
  Turnover energy;
  energy.add(metered.plant().stored_energy(0.0, plan.start), 0.0, 0.0);
  double work = 0, last = plan.start[0];
  for (int k = 0; k < plan.ticks; ++k) {
    const double input = plan.input(k), t = (k + 1) * plan.tick_s;
    metered.hold(input);
    solver.advance(metered, t);
    const auto& x = solver.state();
    for (const double value : x) record.finite &= std::isfinite(value);
    record.error = std::fmax(record.error, std::fabs(x[0] - second_way(k, input)));
    work += input * (x[0] - last), last = x[0];
    energy.add(metered.plant().stored_energy(t, Metered<P>::own(x)),
               x[Metered<P>::kSupplied] - x[Metered<P>::kDissipated], work);
  }
  record.gained = energy.gained(), record.imbalance = energy.imbalance();
  record.status = solver.status(), record.counters = solver.counters();
  return record;
}

// The closed form cannot propagate a quadratic quantity; therefore its energy is integrated over its own dense output,
// piece by piece and up to each change of the mode.
template <AffinePlant P>
class DenseBalance {
 public:
  DenseBalance(const P& plant, const ClosedForm<P>& solver, const std::vector<double>& corners, double scale)
      : plant_(plant), solver_(solver), corners_(corners), scale_(scale) {}
  double operator()(double a, double b) const { return over(a, mode(a), b, mode(b), 0); }

 private:
  // A mode, and between which corners.
  struct Stretch {
    Mode mode;
    std::ptrdiff_t corners;
    bool operator==(const Stretch&) const = default;
  };
  Stretch mode(double t) const {
    const auto x = solver_.at(t);
    return {plant_.mode_at(t, x), std::ranges::count_if(corners_, [&](double corner) { return x[0] > corner; })};
  }
  double power(Mode m, double t) const {
    const auto flow = plant_.power(m, t, solver_.at(t));
    return flow.supplied - flow.dissipated;
  }
  double over(double a, Stretch at_a, double b, Stretch at_b, int depth) const {
    const double middle = 0.5 * (a + b);
    if (at_a != at_b && depth < 45 && middle > a && middle < b) {
      const Stretch between = mode(middle);
      return over(a, at_a, middle, between, depth + 1) + over(middle, between, b, at_b, depth + 1);
    }
    if (at_a != at_b) return 0.0;
    return smooth(at_a.mode, a, b, gauss(at_a.mode, a, b), depth);
  }
  // Halved until the halves agree with the whole, because a plant that has just been pushed settles very fast.
  double smooth(Mode m, double a, double b, double whole, int depth) const {
    const double middle = 0.5 * (a + b), left = gauss(m, a, middle), right = gauss(m, middle, b);
    const double sum = left + right;
    const double enough = 1e-9 * (std::fabs(left) + std::fabs(right)) + 1e-13 * scale_;
    if (std::fabs(sum - whole) <= enough || depth > 40) return sum;
    return smooth(m, a, middle, left, depth + 1) + smooth(m, middle, b, right, depth + 1);
  }
  // Three points.
  double gauss(Mode m, double a, double b) const {
    const double middle = 0.5 * (a + b), h = 0.5 * (b - a), r = 0.7745966692414834 * h;
    return h / 9 * (5 * power(m, middle - r) + 8 * power(m, middle) + 5 * power(m, middle + r));
  }
  const P& plant_;
  const ClosedForm<P>& solver_;
  const std::vector<double>& corners_;
  double scale_;  // J
};

template <AffinePlant P>
PlantRecord run_closed(const PlantPlan<P>& plan, const SecondWay& second_way) {
  P plant(plan.params);
  plant.hold(plan.input(0));
  ClosedForm<P> solver(plan.settings);
  solver.start(plant, 0.0, plan.start);
  PlantRecord record;
  Turnover energy;
  double balance = 0, work = 0, last = plan.start[0];
  energy.add(plant.stored_energy(0.0, plan.start), 0.0, 0.0);
  // Pieces so short that three points resolve every oscillation.
  double fastest = 0;
  for (const Situation<P>& s : plant.situations())
    fastest = std::max(fastest, std::abs(fastest_eigenvalue(plant, s.mode, s.t, s.x)));
  const int pieces = static_cast<int>(std::clamp(std::ceil(plan.tick_s * fastest / 0.5), 2.0, 2000.0));
  for (int k = 0; k < plan.ticks; ++k) {
    const double input = plan.input(k), begin = k * plan.tick_s, end = (k + 1) * plan.tick_s;
    plant.hold(input);
    const DenseBalance<P> over(plant, solver, plan.corners, energy.most() + 1e-3 * std::fabs(input));
    const ClosedForm<P> before = solver;
    solver.advance(plant, end);
    if (solver.counters().events == before.counters().events) {
      balance += over(begin, end);
    } else {  // the same in pieces so short that none can hide a contact
      solver = before;
      for (int i = 0; i < pieces; ++i) {
        const double a = i == 0 ? begin : solver.time();
        const double b = i + 1 < pieces ? begin + plan.tick_s * (i + 1) / pieces : end;
        solver.advance(plant, b);
        balance += over(a, b);
      }
    }
    const auto& x = solver.state();
    for (const double value : x) record.finite &= std::isfinite(value);
    record.error = std::fmax(record.error, std::fabs(x[0] - second_way(k, input)));
    work += input * (x[0] - last), last = x[0];
    energy.add(plant.stored_energy(solver.time(), x), balance, work);
  }
  record.gained = energy.gained(), record.imbalance = energy.imbalance();
  record.status = solver.status(), record.counters = solver.counters();
  return record;
}

inline Outcome outcome_of(const PlantRecord& record, std::string second_way, double energy_within) {
  Outcome out;
  out.error = record.error;
  out.unit = "rad";
  out.second_way = std::move(second_way);
  out.energy = record.imbalance;
  out.energy_within = energy_within;
  out.work = record.counters.steps + record.counters.derivatives;
  out.budget = 50'000'000;
  out.what = std::to_string(record.counters.events) + " events, " + std::string(name_of(record.status));
  if (!record.finite) out.first_bad = Block::kIntegrator;
  if (record.status != IntegratorStatus::kOk) out.refusal = std::string(name_of(record.status));
  return out;
}

}  // namespace farhand::extreme
