#include "netem/lab/precision.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace farhand {
namespace {

constexpr int kFineSteps = 500;  // of a second opinion, where there is no CVODE
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// What long double rounds to, of what double rounds to: 2^-11.
constexpr double kLongOverDouble =
    static_cast<double>(std::numeric_limits<long double>::epsilon()) / std::numeric_limits<double>::epsilon();

// Largest of both sides, by tick.
std::vector<double> difference(const std::vector<double>& m, const std::vector<double>& s,
                               const std::vector<double>& m_ref, const std::vector<double>& s_ref) {
  std::vector<double> out(m_ref.size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    const double a = std::abs(m[k] - m_ref[k]), b = std::abs(s[k] - s_ref[k]);
    out[k] = std::isfinite(a) && std::isfinite(b) ? std::max(a, b) : kNan;
  }
  return out;
}

double rms(const std::vector<double>& e, std::size_t from, std::size_t until) {
  double sum = 0;
  for (std::size_t k = from; k < until; ++k) sum += e[k] * e[k];
  return until > from ? std::sqrt(sum / static_cast<double>(until - from)) : 0;
}

PrecisionError summary(const std::vector<double>& e) {
  PrecisionError out;
  if (e.empty()) return out;
  out.end = e.back();
  out.rms = rms(e, 0, e.size());
  for (const double y : e) out.max = std::isnan(y) || y > out.max ? y : out.max;
  double worst = 0, last = 0;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    last = rms(e, quarter * e.size() / 4, (quarter + 1) * e.size() / 4);
    worst = std::max(worst, last);
  }
  out.growth = worst > 0 ? last / worst : 0;
  return out;
}

PrecisionError scaled(PrecisionError e, double factor) {
  e.end *= factor, e.rms *= factor, e.max *= factor;
  return e;
}

// No number of this size is kept better than that.
PrecisionError floored(PrecisionError e, double size) {
  const double rounding = 0.5 * std::numeric_limits<double>::epsilon() * size;
  for (double* y : {&e.end, &e.rms, &e.max}) *y = std::max(*y, rounding);
  return e;
}

struct Errors {
  std::vector<double> position, force;
  Errors(const Trajectory& run, const Trajectory& reference)
      : position(difference(run.x_m, run.x_s, reference.x_m, reference.x_s)),
        force(difference(run.f_m, run.f_s, reference.f_m, reference.f_s)) {}
};

// Where an unstable integrator shows: its error is as large as the motion.
double amplitude(const Trajectory& t) {
  double most = 0;
  for (const auto* x : {&t.x_m, &t.x_s})
    for (const double y : *x) most = std::max(most, std::abs(y - x->front()));
  return most;
}

double largest(const std::vector<double>& m, const std::vector<double>& s) {
  double most = 0;
  for (const auto* f : {&m, &s})
    for (const double y : *f) most = std::max(most, std::abs(y));
  return most;
}

struct Contact {
  double rate = 0, damping_ratio = 0;  // rad/s
};
std::optional<Contact> wall_contact(const scene::Scene& scene) {
  if (!scene.slave().has_wall()) return {};
  const bool elastic = scene.slave().device() == scene::SERIES_ELASTIC;
  const double J = elastic ? scene.slave().series_elastic().j_joint_kgm2() : scene.slave().motor().j_kgm2();
  const scene::Wall& wall = scene.slave().wall();
  const double rate = std::sqrt(wall.stiffness_nm_per_rad() / J);
  return Contact{rate, wall.damping_nms_per_rad() / (2 * J * rate)};
}

// Where a wall is so stiff that a hundredth of the hold does not resolve its oscillation well, finer ones belong to it,
// so that the four which an order is fitted over do.
std::vector<int> steps_of(const PrecisionSettings& settings, const scene::Scene& scene, double hold_s) {
  std::vector<int> steps = settings.steps_per_hold;
  const std::optional<Contact> contact = wall_contact(scene);
  if (contact && contact->rate * hold_s / 100 > 0.05) steps.insert(steps.end(), {150, 200, 300, 500});
  return steps;
}

std::vector<BareChoice> choices(const PrecisionSettings& settings, const std::vector<int>& all_steps, double hold_s,
                                bool affine) {
  std::vector<BareChoice> out;
  for (const BareMethod method :
       {BareMethod::kSemiImplicitEuler, BareMethod::kRk4, BareMethod::kSdirk2, BareMethod::kRosenbrock})
    for (const int steps : all_steps) out.push_back({method, hold_s / steps, 0});
  for (const double rtol : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11}) out.push_back({BareMethod::kAdaptive, 0, rtol});
  if (affine) out.push_back({BareMethod::kAdaptive, 0, 1e-13});  // else it is the reference
  if (affine) out.push_back({BareMethod::kClosedForm, 0, 0});
  out.push_back({BareMethod::kWorld, 0, 0});
  if (settings.competitor && settings.has_cvode) {
    for (const BareMethod method : {BareMethod::kCvodeBdf, BareMethod::kCvodeAdams})
      for (const double rtol : {1e-3, 1e-5, 1e-7, 1e-9, 1e-12}) out.push_back({method, 0, rtol});
  }
  return out;
}

// Takes turns, so that a machine that is slow for a while is slow for all.
void time_all(const scene::Scene& scene, int runs, std::vector<PrecisionRow>& rows, const Workload& work) {
  const std::int64_t ticks = ticks_of(scene);
  for (int round = 0; round < runs; ++round) {
    for (PrecisionRow& row : rows) {
      work.require_all(!work.stopped());
      if (!row.ok()) continue;
      const auto run = make_bare_run(scene, row.choice, !row.quantised);
      const auto begin = std::chrono::steady_clock::now();
      run->run(ticks);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      row.wall_s.push_back(seconds / (static_cast<double>(ticks) * scene.tick_s()));
    }
  }
  for (PrecisionRow& row : rows) std::sort(row.wall_s.begin(), row.wall_s.end());
}

PrecisionRow measured(const scene::Scene& scene, const BareChoice& choice, bool quantised,
                      const Trajectory& reference) {
  PrecisionRow row;
  row.choice = choice;
  row.quantised = quantised;
  row.is_default = choice.method == BareMethod::kWorld;
  const Trajectory run = make_bare_run(scene, choice, !quantised)->record(ticks_of(scene));
  Errors errors(run, reference);
  row.failure = run.failure;
  row.position = summary(errors.position);
  row.force = summary(errors.force);
  row.steps = run.steps;
  row.events = run.events;
  row.position_error = std::move(errors.position);
  row.force_error = std::move(errors.force);
  if (row.ok() && !(row.position.max < amplitude(reference))) row.failure = "error as large as the motion";
  const double force = largest(reference.f_m, reference.f_s);
  if (row.ok() && force > 0 && !(row.force.growth * row.force.rms < 0.3 * force)) row.failure = "force does not settle";
  return row;
}

// What rounding leaves of runs of a step. Where RK4 gets no better with shorter steps, its truncation is gone and what
// it is left with is rounding, which all methods of that many steps share: it rounds the state once per step, and what
// creeps is rounded away in the same direction each time. Where RK4 still gets better, rounding is taken to add up as a
// random walk does.
class Floor {
 public:
  Floor(const PrecisionResult& result, PrecisionError PrecisionRow::*pick, double reference, double range)
      : reference_(reference), range_(range) {
    for (const PrecisionRow& row : result.rows)
      if (row.choice.method == BareMethod::kRk4 && !row.quantised && row.ok())
        rk4_.emplace_back(row.choice.step_s, (row.*pick).rms);
    std::sort(rk4_.begin(), rk4_.end());
    const auto by_error = [](const auto& a, const auto& b) { return a.second < b.second; };
    best_ = static_cast<std::size_t>(std::min_element(rk4_.begin(), rk4_.end(), by_error) - rk4_.begin());
  }

  double operator()(const PrecisionRow& row) const {
    if (best_ == 0 || rk4_.empty()) {
      const double ulp = std::numeric_limits<double>::epsilon() * range_;
      return std::hypot(reference_, 0.5 * ulp * std::sqrt(static_cast<double>(row.steps) / 2));
    }
    double least = rk4_[best_].second;
    for (std::size_t i = 0; i < best_; ++i)
      if (rk4_[i].first >= row.choice.step_s * (1 - 1e-9)) least = std::max(least, rk4_[i].second);
    return least;
  }

 private:
  double reference_, range_;
  std::vector<std::pair<double, double>> rk4_;  // step and error, finest first
  std::size_t best_ = 0;
};

struct Fit {
  double order = kNan;
  std::vector<double> used;
};
Fit fit_order(const PrecisionResult& result, BareMethod method, PrecisionError PrecisionRow::*pick, const Floor& floor,
              double range) {
  std::vector<OrderPoint> runs;
  for (const PrecisionRow& row : result.rows)
    if (row.choice.method == method && !row.quantised && row.ok())
      runs.push_back({row.choice.step_s, (row.*pick).rms, floor(row)});
  Fit fit;
  fit.order = fitted_order(runs, 1e-3 * range, fit.used);
  return fit;
}

void fit_orders(PrecisionResult& result, const std::optional<Contact>& contact, double position_range,
                double force_range) {
  const auto least = [](const PrecisionError& rounding, const PrecisionError& floor) {
    return std::isnan(rounding.rms) ? floor.rms : rounding.rms;
  };
  const Floor position_floor(result, &PrecisionRow::position, least(result.rounding_position, result.floor_position),
                             position_range);
  const Floor force_floor(result, &PrecisionRow::force, least(result.rounding_force, result.floor_force), force_range);
  for (const BareMethod method :
       {BareMethod::kSemiImplicitEuler, BareMethod::kRk4, BareMethod::kSdirk2, BareMethod::kRosenbrock}) {
    const Fit position = fit_order(result, method, &PrecisionRow::position, position_floor, position_range);
    FittedOrder fit{method, order_of(method), static_cast<int>(position.used.size()), position.order};
    fit.force = fit_order(result, method, &PrecisionRow::force, force_floor, force_range).order;
    if (!position.used.empty()) fit.finest_s = position.used.front(), fit.coarsest_s = position.used.back();
    fit.shifts_only = contact && shifts_contacts_only(fit.theory, contact->damping_ratio);
    result.orders.push_back(fit);
  }
}

// No step is longer than an input is held. So all tolerances that such a step satisfies do the very same work, and only
// the tightest of them is kept.
void keep_distinct(std::vector<PrecisionRow>& rows) {
  for (std::size_t k = rows.size(); k-- > 1;) {
    PrecisionRow &looser = rows[k - 1], &tighter = rows[k];
    if (looser.choice.method != tighter.choice.method || !takes_a_tolerance(tighter.choice.method)) continue;
    if (looser.position_error != tighter.position_error || looser.steps != tighter.steps) continue;
    tighter.looser_too = true;
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(k) - 1);
  }
}

}  // namespace

bool shifts_contacts_only(int order, double damping_ratio) {
  return damping_ratio < 1 && std::abs(std::sin(order * std::acos(-damping_ratio))) < 0.1;
}

double fitted_order(const std::vector<OrderPoint>& runs, double saturation, std::vector<double>& used) {
  constexpr std::size_t kFinest = 4;
  std::vector<std::pair<double, double>> points;  // step and error
  for (const OrderPoint& run : runs)
    if (run.error > 10 * run.floor && run.error < saturation) points.emplace_back(run.step, run.error);
  std::sort(points.begin(), points.end());
  if (points.size() > kFinest) points.resize(kFinest);
  used.clear();
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [step, error] : points) {
    const double a = std::log(step), b = std::log(error);
    n += 1, x += a, y += b, xx += a * a, xy += a * b;
    used.push_back(step);
  }
  return used.size() >= 2 ? (n * xy - x * y) / (n * xx - x * x) : kNan;
}

const PrecisionRow* PrecisionResult::find(const BareChoice& choice, bool quantised) const {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const PrecisionRow& row) {
    return row.choice == choice && row.quantised == quantised;
  });
  return found == rows.end() ? nullptr : &*found;
}

PrecisionResult measure_precision(const LoadedScene& loaded, const PrecisionSettings& settings, const Workload& work) {
  const scene::Scene& scene = loaded.scene;
  const std::int64_t ticks = ticks_of(scene);
  PrecisionResult result;
  result.scene = loaded.name;
  result.scene_text = complete_text(scene);
  result.duration_s = static_cast<double>(ticks) * scene.tick_s();
  result.tick_s = scene.tick_s();
  result.hold_s = hold_of(scene);
  result.methods = methods_of(scene);
  result.runs = settings.runs;
  if (!settings.has_cvode) {
    result.without = "CVODE does not run beside: it (libsundials-dev) was not there when this program was built.";
  } else if (!settings.competitor) {
    result.without = "CVODE does not run beside, as asked.";
  }

  const std::string reason = not_affine(scene);
  const bool affine = reason.empty();
  const BareChoice first =
      affine ? BareChoice{BareMethod::kClosedFormLong, 0, 0} : BareChoice{BareMethod::kAdaptive, 0, 1e-13};
  const BareChoice other = settings.has_cvode ? BareChoice{BareMethod::kCvodeAdams, 0, 1e-12}
                                              : BareChoice{BareMethod::kRk4, result.hold_s / kFineSteps, 0};
  const BareChoice second = affine ? BareChoice{BareMethod::kAdaptive, 0, 1e-13} : other;
  const Trajectory reference = make_bare_run(scene, first)->record(ticks);
  if (!reference.failure.empty()) throw std::runtime_error("the reference failed: " + reference.failure);
  const Errors apart(make_bare_run(scene, second)->record(ticks), reference);
  result.second_position = summary(apart.position);
  result.second_force = summary(apart.force);
  result.rounding_position = result.rounding_force = {kNan, kNan, kNan, kNan};
  if (affine) {
    const Errors rounding(make_bare_run(scene, {BareMethod::kClosedForm, 0, 0})->record(ticks), reference);
    result.rounding_position = summary(rounding.position);
    result.rounding_force = summary(rounding.force);
    // Both are kept in double, which rounds once more.
    result.floor_position = floored(scaled(result.rounding_position, kLongOverDouble), amplitude(reference));
    result.floor_force = floored(scaled(result.rounding_force, kLongOverDouble), largest(reference.f_m, reference.f_s));
    result.reference =
        "closed form, law and plant in long double; its error is estimated as that of the same in double, "
        "times 2^-11";
    result.second = "adaptive pair at a relative tolerance of 1e-13";
  } else {
    result.floor_position = result.second_position;
    result.floor_force = result.second_force;
    result.reference = "adaptive pair at a relative tolerance of 1e-13 (" + reason +
                       "); its error is estimated as its distance from whichever other method lies nearest";
    result.second = settings.has_cvode ? "CVODE Adams at a relative tolerance of 1e-12"
                                       : "RK4 in " + std::to_string(kFineSteps) + " steps between two inputs";
  }

  const std::vector<BareChoice> all =
      choices(settings, steps_of(settings, scene, result.hold_s), result.hold_s, affine);
  result.rows.resize(all.size());
  work.require_all(
      work.each(all.size(), [&](std::size_t k) { result.rows[k] = measured(scene, all[k], false, reference); }));
  keep_distinct(result.rows);
  if (!affine) {
    // Two methods that agree this well over a whole run are unlikely to be wrong together.
    const auto nearer = [](const PrecisionError& a, const PrecisionError& b) { return b.max < a.max ? b : a; };
    for (const PrecisionRow& row : result.rows) {
      if (!takes_a_step(row.choice.method) || !row.ok()) continue;
      result.floor_position = nearer(result.floor_position, row.position);
      result.floor_force = nearer(result.floor_force, row.force);
    }
  }
  fit_orders(result, wall_contact(scene), amplitude(reference), largest(reference.f_m, reference.f_s));
  if (settings.quantised) {
    // Against the same encoders without any step error.
    const Trajectory quantised = make_bare_run(scene, first, false)->record(ticks);
    for (const int steps : settings.steps_per_hold)
      result.rows.push_back(measured(scene, {BareMethod::kRk4, result.hold_s / steps, 0}, true, quantised));
  }
  time_all(scene, settings.runs, result.rows, work);
  return result;
}

}  // namespace farhand
