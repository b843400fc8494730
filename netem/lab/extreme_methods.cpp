// Every integrator on every stiff plant at the same step: who survives, and where the explicit ones must fail.
// Survivors come to rest where the second way has it and make no energy.
#include <cmath>
#include <complex>

#include "common/config/schema.hpp"
#include "common/plant/axis_plant.hpp"
#include "netem/lab/extreme_bounce.hpp"
#include "netem/lab/extreme_families.hpp"
#include "netem/lab/extreme_plant.hpp"

namespace farhand::extreme {
namespace {

using P = DirectSlavePlant;
constexpr double kJ = 0.004, kViscous = 0.002, kAt = 0.1, kPress = 3.0;

struct Stiff {
  double k, ratio;
  double b() const { return 2 * ratio * std::sqrt(k * kJ); }
  std::string name() const { return "wall of " + shortest(k) + " N m/rad, damping ratio " + shortest(ratio); }
};

PlantPlan<P> plan_of(const Stiff& wall, double step) {
  PlantPlan<P> plan;
  plan.params.motor = {.J = kJ, .viscous = kViscous, .encoder_counts_per_rev = 0, .stop_min = -7, .stop_max = 7};
  plan.params.load.wall = Wall::Params{.stiffness = wall.k, .damping = wall.b(), .at = kAt};
  plan.start = {0.0, 1.0};
  plan.input = [](int) { return 0.5; };
  plan.ticks = 1000;
  plan.corners = {kAt};
  plan.settings.max_step = step;
  return plan;
}

// Largest |eigenvalue| of one step h of the linear contact: what theory says of a method.
double growth(Method method, const Stiff& wall, double h) {
  const double w2 = wall.k / kJ, c = (wall.b() + kViscous) / kJ;
  using Complex = std::complex<double>;
  if (method == Method::kSemiImplicitEuler) {  // v += h a, x += h v: z^2 - (2 - h c - h^2 w2) z + (1 - h c) = 0
    const double half = (2 - h * c - h * h * w2) / 2, product = 1 - h * c;
    const Complex root = std::sqrt(Complex(half * half - product));
    return std::max(std::abs(half + root), std::abs(half - root));
  }
  const Complex root = std::sqrt(Complex(c * c / 4 - w2));
  double most = 0;
  for (const Complex& s : {-c / 2 + root, -c / 2 - root}) {
    const Complex z = h * s;
    most = std::max(most, std::abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))));
  }
  return most;
}
double theory_limit(Method method, const Stiff& wall) {
  // The first h at which a step grows.
  const double fastest = std::sqrt(wall.k / kJ) * std::max(1.0, 2 * wall.ratio);
  double low = 0.01 / fastest, high = low;
  while (growth(method, wall, high) <= 1) low = high, high *= 1.01;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (growth(method, wall, middle) <= 1 ? low : high) = middle;
  }
  return low;
}

// Pressed in, disturbed by a thousandth: does a step of h make it grow?
template <class Scheme>
bool settles(const Stiff& wall, double h) {
  PlantPlan<P> plan = plan_of(wall, h);
  P plant(plan.params);
  plant.hold(kPress);
  const double rest = kAt + kPress / wall.k, off = 1e-3 * kPress / wall.k;
  Integrator<Scheme, P> solver(plan.settings);
  solver.start(plant, 0.0, {rest + off, 0.0});
  for (int k = 1; k <= 4000; ++k) {
    solver.advance(plant, k * h);
    if (!(std::fabs(solver.state()[0] - rest) < 20 * off)) return false;
  }
  return solver.status() == IntegratorStatus::kOk;
}

template <class Scheme>
void add_limit(Cases& cases, const Stiff& wall) {
  cases.push_back({"step limits", std::string(Scheme::kName) + ", " + wall.name(), accurate(0.1), [wall] {
                     const double theory = theory_limit(Scheme::kMethod, wall);
                     const double fastest = std::sqrt(wall.k / kJ) * std::max(1.0, 2 * wall.ratio);
                     double low = 0.1 / fastest, high = 10 / fastest;
                     Outcome out;
                     while (high / low > 1.001) {
                       const double middle = std::sqrt(low * high);
                       (settles<Scheme>(wall, middle) ? low : high) = middle;
                       out.work += 4000;
                     }
                     out.error = std::fabs(low / theory - 1);
                     out.unit = "relative";
                     out.second_way = "largest eigenvalue of one step";
                     const double root = std::sqrt(std::max(wall.ratio * wall.ratio - 1, 0.0));
                     const double lambda = std::sqrt(wall.k / kJ) * (wall.ratio > 1 ? wall.ratio + root : 1.0);
                     out.what = "survives up to " + shortest(std::round(low * 1e10) / 1e4) + " us; theory " +
                                shortest(std::round(theory * 1e10) / 1e4) +
                                " us; times |lambda|: " + shortest(std::round(low * lambda * 1e3) / 1e3);
                     return out;
                   }});
}

// Survives or fails at a step; a failing one is expected to where theory says so.
Outcome judged(const PlantRecord& record, std::string second_way, double rest_within) {
  Outcome out = outcome_of(record, std::move(second_way), HUGE_VAL);
  constexpr double kGain = 1e-3;
  out.refusal.clear();
  if (!record.finite || record.status != IntegratorStatus::kOk)
    out.refusal = "fails: " + std::string(name_of(record.status));
  else if (record.gained > kGain)
    out.refusal = "fails: makes " + shortest(std::round(record.gained * 1e4) / 1e4) + " of the energy";
  else if (!(record.error <= rest_within))
    out.refusal = "fails: ends " + shortest(std::round(record.error * 1e9) / 1e3) + " urad off";
  out.first_bad = Block::kNone;
  out.cell = out.refusal.empty() ? "survives" : out.refusal;
  return out;
}

const char* const kFamily = "integrators at 0.5 ms on stiff plants";
constexpr double kStep = 0.5e-3;

// At rest at the end: statics.
SecondWay statics(const Stiff& wall) {
  return [wall](int tick, double torque) { return tick < 999 ? Outcome::kNan : kAt + torque / wall.k; };
}

template <class Scheme>
void add_stepping(Cases& cases, const Stiff& wall) {
  constexpr bool kImplicit =
      Scheme::kMethod == Method::kSdirk2 || Scheme::kMethod == Method::kRosenbrock || Scheme::kEmbedded;
  const bool survives = kImplicit || kStep < theory_limit(Scheme::kMethod, wall);
  Case c{kFamily, wall.name() + ", " + Scheme::kName, survives ? accurate(1e-9) : refused("fails"), [wall] {
           return judged(run_stepping<Scheme>(plan_of(wall, kStep), statics(wall)), "statics, at the end", 1e-8);
         }};
  c.row = wall.name(), c.column = Scheme::kName;
  cases.push_back(std::move(c));
}

void add_wall(Cases& cases, const Stiff& wall) {
  add_stepping<SemiImplicitEuler>(cases, wall);
  add_stepping<Rk4>(cases, wall);
  add_stepping<Sdirk2>(cases, wall);
  add_stepping<Rosenbrock>(cases, wall);
  add_stepping<DormandPrince>(cases, wall);
  Case c{kFamily, wall.name() + ", closed form", accurate(1e-12),
         [wall] { return judged(run_closed(plan_of(wall, kStep), statics(wall)), "statics, at the end", 1e-8); }};
  c.row = wall.name(), c.column = "closed form";
  cases.push_back(std::move(c));
}

using BristlePlant = DirectSlavePlantWith<Friction::kBristle>;

template <class Scheme>
void add_bristle(Cases& cases, double sigma_0, Expected expected) {
  const std::string row = "LuGre bristle of " + shortest(sigma_0) + " N m/rad, pressed with 0.04 N m";
  Case c{kFamily, row + ", " + Scheme::kName, std::move(expected), [sigma_0] {
           PlantPlan<BristlePlant> plan;
           const double sigma_1 = std::sqrt(sigma_0 * kJ);
           LuGrePlan l{.J = kJ,
                       .sigma_0 = sigma_0,
                       .sigma_1 = sigma_1,
                       .sigma_2 = 0.002,
                       .F_c = 0.05,
                       .F_s = 0.07,
                       .v_s = 0.1,
                       .torques = {0.04},
                       .seconds = 0.2};
           const double end = lugre_reference(l)[0][0];
           plan.params.motor = motor_of(l);
           plan.input = [](int) { return 0.04; };
           const SecondWay way = [&](int tick, double) { return tick < 199 ? Outcome::kNan : end; };
           return judged(run_stepping<Scheme>(plan, way), "Fehlberg 7(8), long double, at the end", 1e-5);
         }};
  c.row = row, c.column = Scheme::kName;
  cases.push_back(std::move(c));
}

}  // namespace

void add_methods(Cases& cases) {
  for (const Stiff& wall : {Stiff{1e4, 0.7}, {1e4, 2}, {1e6, 0.1}, {1e6, 0.7}, {1e6, 2}, {1e8, 0.7}, {1e8, 2}})
    add_wall(cases, wall);
  for (const double sigma_0 : {1e4, 1e6}) {
    const bool soft = sigma_0 < 1e5;
    add_bristle<SemiImplicitEuler>(cases, sigma_0, soft ? accurate(1e-5) : refused("fails"));
    add_bristle<Rk4>(cases, sigma_0, soft ? accurate(1e-6) : refused("fails"));
    add_bristle<Sdirk2>(cases, sigma_0, accurate(1e-6));
    add_bristle<Rosenbrock>(cases, sigma_0, accurate(1e-6));
    add_bristle<DormandPrince>(cases, sigma_0, accurate(1e-9));
  }
  for (const Stiff& wall : {Stiff{1e4, 0.1}, {1e4, 0.7}, {1e4, 2}, {1e6, 0.1}, {1e6, 2}, {1e8, 0.7}}) {
    add_limit<Rk4>(cases, wall);
    add_limit<SemiImplicitEuler>(cases, wall);
  }
}

}  // namespace farhand::extreme
