// The bare loop against the real stations, and what the lab says about the error of its integrators.
#include "netem/lab/precision.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <sstream>

#include "common/config/load.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "netem/lab/bare_run.hpp"
#include "netem/lab/precision_report.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/alloc_counter.hpp"

namespace farhand {
namespace {

const std::vector<std::string> kIdealEncoders = {"master.motor.encoder_counts_per_rev=0",
                                                 "slave.motor.encoder_counts_per_rev=0"};

// The shipped scenes rest until both sides are engaged, so that engagement leaves nothing but rounding behind; plain
// four channels carry that on for a while.
TEST(BareLoop, IsWhatTheStationsDoOnceEngaged) {
  for (const char* name :
       {"four_channel", "four_channel_wall", "zero_delay", "four_channel_cdob", "four_channel_cdob_sdcv"}) {
    const LoadedScene loaded = load_scene(name, kIdealEncoders);
    const Session session = simulate(loaded);
    // The first row stands before the first tick.
    const Trajectory bare = make_bare_run(loaded.scene, {BareMethod::kWorld, 0, 0})->record(ticks_of(loaded.scene));
    double worst = 0, moved = 0;
    for (std::size_t k = 1; k < session.master.size(); ++k) {
      worst = std::max({worst, std::abs(bare.x_m[k - 1] - session.master[k].true_x_rad),
                        std::abs(bare.x_s[k - 1] - session.slave[k].true_x_rad)});
      moved = std::max(moved, std::abs(session.slave[k].true_x_rad));
    }
    EXPECT_GT(moved, 0.05);
    EXPECT_LT(worst, 1e-12);
    std::printf("%s: largest difference of angle %.2g rad\n", name, worst);
  }
}

double largest(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t k = 0; k < a.size(); ++k) worst = std::max(worst, std::abs(a[k] - b[k]));
  return worst;
}
double largest(const Trajectory& a, const Trajectory& b) {
  return std::max(largest(a.x_m, b.x_m), largest(a.x_s, b.x_s));
}

// Until shortly after the first touch: 3 s.
const scene::Scene& wall() {
  static const scene::Scene scene = load_scene("four_channel_wall", std::vector<std::string>{"duration_s=10"}).scene;
  return scene;
}
constexpr std::int64_t kTouched = 3000;

TEST(BareRun, ClosedFormIsThatOfLongDouble) {
  const Trajectory reference = make_bare_run(wall(), {BareMethod::kClosedFormLong, 0, 0})->record(ticks_of(wall()));
  const Trajectory closed = make_bare_run(wall(), {BareMethod::kClosedForm, 0, 0})->record(ticks_of(wall()));
  EXPECT_TRUE(reference.failure.empty() && closed.failure.empty());
  EXPECT_GT(*std::ranges::max_element(reference.f_s), 1.0);
  EXPECT_LT(largest(closed, reference), 1e-13);  // asked are 1e-10
  std::printf("largest difference of angle %.2g rad\n", largest(closed, reference));
}

TEST(BareRun, CvodeFindsTheSameMotion) {
  const Trajectory closed = make_bare_run(wall(), {BareMethod::kClosedForm, 0, 0})->record(kTouched);
  for (const BareMethod method : {BareMethod::kCvodeBdf, BareMethod::kCvodeAdams}) {
    const Trajectory competitor = make_bare_run(wall(), {method, 0, 1e-9})->record(kTouched);
    EXPECT_EQ(competitor.failure, "");
    EXPECT_LT(largest(competitor, closed), 1e-6) << name_of(method);
    EXPECT_EQ(competitor.events, closed.events);
    std::printf("%s: largest difference of angle %.2g rad\n", name_of(method).data(), largest(competitor, closed));
  }
}

TEST(BareRun, OrthosisRunsWithIdealEncodersInBothScalars) {
  const scene::Scene scene = load_scene("sea_four_channel_cdob_sdcv").scene;
  constexpr std::int64_t kTicks = 6000;
  const Trajectory reference = make_bare_run(scene, {BareMethod::kClosedFormLong, 0, 0})->record(kTicks);
  EXPECT_GT(*std::ranges::max_element(reference.x_s), 0.1);
  EXPECT_LT(largest(make_bare_run(scene, {BareMethod::kClosedForm, 0, 0})->record(kTicks), reference), 1e-12);
  EXPECT_LT(largest(make_bare_run(scene, {BareMethod::kRk4, 50e-6, 0})->record(kTicks), reference), 1e-8);
}

TEST(BareRun, RefusesTheClosedFormForABristleWithTheReason) {
  const scene::Scene scene = load_scene("sea_friction").scene;
  EXPECT_THROW(make_bare_run(scene, {BareMethod::kClosedForm, 0, 0}), std::invalid_argument);
  EXPECT_NE(not_affine(scene).find("bristle"), std::string::npos) << not_affine(scene);
  EXPECT_EQ(not_affine(wall()), "");
}

TEST(Precision, FitsTheSlopeOfTheFinestAboveTheFloor) {
  std::vector<OrderPoint> runs = {{1, 1.0, 1e-6},           {0.5, 1e-2 / 4, 1e-6}, {0.25, 1e-2 / 16, 1e-6},
                                  {0.125, 1e-2 / 64, 1e-6}, {2, 3e-2, 1e-6},       {0.0625, 1e-2 / 256, 1e-6},
                                  {0.03125, 8e-6, 1e-6}};
  std::vector<double> used;
  EXPECT_NEAR(fitted_order(runs, 0.1, used), 2.0, 1e-12);
  EXPECT_EQ(used, (std::vector<double>{0.0625, 0.125, 0.25, 0.5}));
  for (OrderPoint& run : runs) run.floor = 1.0;
  EXPECT_TRUE(std::isnan(fitted_order(runs, 2.0, used)));
}

// A mass of 1 that comes from the left with a speed of 1 and leaves a spring of 1 as soon as that no longer pushes.
struct Bounce {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, kStates>;
  double zeta;

  Mode mode_at(double, const State& x) const noexcept { return x[0] >= 0 && push(x) >= 0 ? 1 : 0; }
  State derivative(Mode mode, double, const State& x) const noexcept { return {x[1], mode ? -push(x) : 0}; }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept {
    return {{{0, 1}, {mode ? -1.0 : 0.0, mode ? -2 * zeta : 0.0}}};
  }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode mode, double, const State& x) const noexcept { return {mode ? push(x) : 1.0}; }
  Mode cross(Mode, std::size_t, double, State&) const noexcept { return 0; }
  double next_break(double) const noexcept { return HUGE_VAL; }

 private:
  double push(const State& x) const noexcept { return x[0] + 2 * zeta * x[1]; }
};

// x' = 0.3 - x, all but there.
struct Creep {
  static constexpr std::size_t kStates = 1, kGuards = 0;
  using State = std::array<double, 1>;
  Mode mode_at(double, const State&) const noexcept { return 0; }
  State derivative(Mode, double, const State& x) const noexcept { return {0.3 - x[0]}; }
  StateMatrix<1> jacobian(Mode, double, const State&) const noexcept { return {{{-1}}}; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 0> guards(Mode, double, const State&) const noexcept { return {}; }
  Mode cross(Mode mode, std::size_t, double, State&) const noexcept { return mode; }
  double next_break(double) const noexcept { return HUGE_VAL; }
};

// A step moves it by 3e-15 of itself, fifty times what double resolves there and less than Newton leaves as a residual.
TEST(Precision, CreepIsNotTakenForRest) {
  IntegratorSettings settings;
  settings.max_step = 1e-5;
  Integrator<Sdirk2, Creep> integrator(settings);
  integrator.start({}, 0, {0.3 + 1e-10});
  integrator.advance({}, 1);
  EXPECT_NEAR(integrator.state()[0] - 0.3, 1e-10 * std::exp(-1), 1e5 * 0.5 * 5.6e-17);  // each step rounds
}

// How much too fast the mass leaves, and how late.
struct Exit {
  double v, late;
};
struct ExactExit {
  double t, x, v;
  explicit ExactExit(double zeta) {
    const double s = std::sqrt(1 - zeta * zeta);
    t = (M_PI - std::atan2(2 * zeta * s, 1 - 2 * zeta * zeta)) / s;
    const double decay = std::exp(-zeta * t);
    x = decay * std::sin(s * t) / s;
    v = decay * (std::cos(s * t) - zeta / s * std::sin(s * t));
  }
};
template <class Scheme>
Exit bounced(double zeta, int steps) {
  constexpr double kEnd = 6;
  IntegratorSettings settings;
  settings.max_step = kEnd / steps;
  Integrator<Scheme, Bounce> integrator(settings);
  const Bounce plant{zeta};
  integrator.start(plant, 0, {0, 1});
  integrator.advance(plant, kEnd);
  EXPECT_EQ(integrator.counters().events, 1u);
  const ExactExit exact(zeta);
  const double v = integrator.state()[1] - exact.v;
  const double x = integrator.state()[0] - (exact.x + exact.v * (kEnd - exact.t));
  return {v, -(x - v * (kEnd - exact.t)) / exact.v};
}
template <class Scheme>
void expect_orders(double zeta, int v, int late) {
  const Exit coarse = bounced<Scheme>(zeta, 150), fine = bounced<Scheme>(zeta, 300);
  EXPECT_NEAR(std::log2(std::abs(coarse.v / fine.v)), v, 0.2) << Scheme::kName << ' ' << zeta;
  EXPECT_NEAR(std::log2(std::abs(coarse.late / fine.late)), late, 0.2) << Scheme::kName << ' ' << zeta;
  std::printf("%-10s zeta %.3f: speed order %.2f, instant order %.2f\n", Scheme::kName, zeta,
              std::log2(std::abs(coarse.v / fine.v)), std::log2(std::abs(coarse.late / fine.late)));
}

// Why a damped wall may seem to give one order more than a method has (precision.hpp).
TEST(Precision, LeadingErrorOnlyShiftsAContactWhereLambdaToTheOrderIsReal) {
  expect_orders<Sdirk2>(0.3, 2, 2);
  expect_orders<Rosenbrock>(0.3, 3, 3);
  expect_orders<Rk4>(0.3, 4, 4);
  expect_orders<Sdirk2>(0, 3, 2);
  expect_orders<Rosenbrock>(0.5, 4, 3);
  expect_orders<Rk4>(M_SQRT1_2, 5, 4);
  // The size of the shift, too: exp(z) less the stability function of RODAS3 begins with z^4 / 48, so lambda becomes
  // lambda (1 - h^3 / 48). The step that ends on the exit is short: by up to h of the contact's t.
  const double h = 6.0 / 300, t = ExactExit(0.5).t;
  EXPECT_NEAR(bounced<Rosenbrock>(0.5, 300).late, t * h * h * h / 48, t * h * h * h / 48 * 2 * h / t);

  EXPECT_TRUE(shifts_contacts_only(3, 0.5) && shifts_contacts_only(4, 0.707) && shifts_contacts_only(2, 0));
  EXPECT_FALSE(shifts_contacts_only(1, 0.5) || shifts_contacts_only(2, 0.5) || shifts_contacts_only(4, 0.5));
  for (const int order : {1, 2, 3, 4}) EXPECT_FALSE(shifts_contacts_only(order, 0.3)) << order;
}

// Everything that the command writes, on a short free motion. Theory is order 1, 4, 2, 3.
TEST(Precision, FindsTheOrdersOfAFreeMotion) {
  const LoadedScene loaded =
      load_scene("four_channel", std::vector<std::string>{"duration_s=4", "windows.free.from_s=3",
                                                          "windows.free.until_s=4", "windows.contact.from_s=3",
                                                          "windows.contact.until_s=4", "slave.hand.from_s=1000"});
  PrecisionSettings settings;
  settings.runs = 1;
  settings.competitor = false;
  settings.steps_per_hold = {1, 2, 4, 8};
  const PrecisionResult result = measure_precision(loaded, settings);
  for (const FittedOrder& fit : result.orders) {
    if (fit.points < 2) continue;
    EXPECT_NEAR(fit.position, fit.theory, 0.2) << name_of(fit.method);
  }
  const PrecisionRow* own = result.find({BareMethod::kWorld, 0, 0});
  ASSERT_NE(own, nullptr);
  EXPECT_TRUE(own->is_default);
  EXPECT_LT(own->position.max, 1e-14);
  std::ostringstream table, csv;
  print_precision(result, table);
  write_precision_csv(result, csv);
  EXPECT_NE(table.str().find("orders of convergence"), std::string::npos);
  EXPECT_EQ(std::ranges::count(csv.str(), '\n'), 4001);
  EXPECT_NE(precision_json(result).find("\"orders\""), std::string::npos);
  EXPECT_EQ(precision_html(result).find("nan"), std::string::npos);
}

TEST(BareRun, AllocatesNothingOnceItRuns) {
  if (kCounterIsBlind) GTEST_SKIP();
  const auto run = make_bare_run(wall(), {BareMethod::kClosedForm, 0, 0}, false);
  const TouchCounter counter;
  run->run(4000);
  EXPECT_EQ(counter.since(), Touched{});
}

// Built without CVODE, everything else is there, and text and report say what is missing and why.
TEST(Precision, SaysThatItWasBuiltWithoutCvode) {
  PrecisionSettings settings;
  settings.runs = 1;
  settings.quantised = settings.has_cvode = false;
  settings.steps_per_hold = {20};
  const std::vector<std::string> shorter = {"duration_s=3", "windows.free.from_s=0.5", "windows.free.until_s=1.5",
                                            "windows.contact.from_s=2", "windows.contact.until_s=3"};
  for (const char* name : {"four_channel_wall", "sea_friction"}) {
    const PrecisionResult result = measure_precision(load_scene(name, shorter), settings);
    EXPECT_FALSE(result.rows.empty());
    for (const PrecisionRow& row : result.rows) EXPECT_EQ(name_of(row.choice.method).find("CVODE"), std::string::npos);
    EXPECT_EQ(result.second.find("CVODE"), std::string::npos);
    EXPECT_TRUE(std::isfinite(result.second_position.max)) << name;
    EXPECT_LT(result.second_position.max, 1e-6) << name;
    std::ostringstream text;
    print_precision(result, text);
    for (const std::string& page : {text.str(), precision_html(result), precision_json(result)})
      EXPECT_NE(page.find("was not there when this program was built"), std::string::npos) << name;
  }
}

// The whole scene against CVODE, both timed in turns. A ratio, and far from its limit: 1/100 is asked.
TEST(NightlyPrecision, ClosedFormIsExactAndAHundredTimesFasterThanCvode) {
  PrecisionSettings settings;
  settings.quantised = false;
  settings.steps_per_hold = {20};
  const PrecisionResult result = measure_precision(load_scene("four_channel_wall"), settings);
  const PrecisionRow* closed = result.find({BareMethod::kClosedForm, 0, 0});
  const PrecisionRow* bdf = result.find({BareMethod::kCvodeBdf, 0, 1e-9});
  ASSERT_TRUE(closed != nullptr && bdf != nullptr && bdf->ok());
  EXPECT_LT(closed->position.max, 1e-10);
  for (const BareMethod method : {BareMethod::kCvodeBdf, BareMethod::kCvodeAdams})
    EXPECT_LT(result.find({method, 0, 1e-12})->position.max, 2e-9);
  EXPECT_LT(closed->wall_median(), bdf->wall_median() / 100);
  std::printf("closed form: error %.2g rad, %.0f us per simulated second, 1/%.0f of CVODE BDF at 1e-9\n",
              closed->position.max, 1e6 * closed->wall_median(), bdf->wall_median() / closed->wall_median());
}

// Theory within 0.2 on both sides, from four steps that are short against the fastest rate of the motion and leave an
// error above the floor. `shifted`: where the leading error of this method is a mere shift in time, a mixture of its
// order and the next one shows.
void expect_orders_of_theory(const char* what, double rate_rad_s, const LoadedScene& loaded,
                             std::optional<BareMethod> shifted = {}) {
  PrecisionSettings settings;
  settings.runs = 0;
  settings.competitor = settings.quantised = false;
  for (const FittedOrder& fit : measure_precision(loaded, settings).orders) {
    SCOPED_TRACE(std::string(what) + ", " + std::string(name_of(fit.method)));
    std::printf("%-22s %-20s order %.2f over %d steps of %.3g to %.3g us\n", what, name_of(fit.method).data(),
                fit.position, fit.points, 1e6 * fit.finest_s, 1e6 * fit.coarsest_s);
    EXPECT_EQ(fit.points, 4);
    EXPECT_LT(rate_rad_s * fit.coarsest_s, 0.2);
    EXPECT_EQ(fit.shifts_only, fit.method == shifted);
    if (fit.shifts_only) {
      EXPECT_GT(fit.position, fit.theory + 0.2);
    } else {
      EXPECT_NEAR(fit.position, fit.theory, 0.2);
    }
  }
}

TEST(NightlyPrecision, OrdersAreThoseOfTheory) {
  const auto scene = [](const char* name, const std::vector<std::string>& sets) { return load_scene(name, sets); };
  const double arm = std::sqrt(10 / 0.005);  // the therapist's, on the device
  expect_orders_of_theory("free", arm, scene("four_channel", {"slave.hand.from_s=1000"}));
  expect_orders_of_theory("soft contact", arm, scene("four_channel", {}));
  expect_orders_of_theory("wall 1e4", std::sqrt(1e4 / 0.004), scene("four_channel_wall", {}));
  const auto wall = [&scene](const char* damping) {
    return scene("four_channel_wall",
                 {"slave.wall.stiffness_nm_per_rad=1e6", std::string("slave.wall.damping_nms_per_rad=") + damping,
                  "duration_s=5", "windows.contact.until_s=5"});
  };
  expect_orders_of_theory("wall 1e6, zeta 0.3", std::sqrt(1e6 / 0.004), wall("38"));
  expect_orders_of_theory("wall 1e6, zeta 0.5", std::sqrt(1e6 / 0.004), wall("63"), BareMethod::kRosenbrock);
  // The torque of the bristle, 20 N m/rad up to 0.05 N m, changes as fast as the joint moves: 0.25 rad at 0.5 Hz.
  expect_orders_of_theory("friction", 0.25 * M_PI * 20 / 0.05, scene("sea_friction", {}));
}

// What it does not know it says, and computes nothing else instead.
TEST(BareLoop, RefusesWhatItDoesNotKnow) {
  const auto refusal = [](const char* name, const char* set) {
    try {
      make_bare_run(load_scene(name, std::vector<std::string>{set}).scene, {BareMethod::kWorld, 0, 0});
    } catch (const std::invalid_argument& refused) {
      return std::string(refused.what());
    }
    return std::string();
  };
  for (const char* scene : {"two_channel", "wave"})
    EXPECT_NE(refusal(scene, "seed=1").find("runs in whole sessions only"), std::string::npos) << scene;
  for (const char* scale : {"control.position_scale=1.5", "control.force_scale=0.5"})
    EXPECT_NE(refusal("four_channel", scale).find("sides of one size"), std::string::npos) << scale;
  EXPECT_NE(refusal("four_channel", "master.therapist.reaction={above_nm: 1}").find("who gives way"),
            std::string::npos);
  EXPECT_EQ(refusal("four_channel", "control.position_scale=1"), "");
}

}  // namespace
}  // namespace farhand
