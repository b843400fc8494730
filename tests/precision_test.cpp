// The bare loop against the real stations, and what the lab says about the error of its integrators.
#include "tests/lab/precision.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "common/config/load.hpp"
#include "tests/lab/bare_run.hpp"
#include "tests/lab/precision_report.hpp"
#include "tests/lab/simulation.hpp"
#include "tests/lab/sweep.hpp"
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

TEST(Precision, FitsTheSlopeAboveTheFloorOnly) {
  std::vector<OrderPoint> runs = {
      {1, 1.0, 1e-6}, {0.5, 1e-2 / 4, 1e-6}, {0.25, 1e-2 / 16, 1e-6}, {0.125, 1e-2 / 64, 1e-6}, {0.0625, 8e-6, 1e-6}};
  int points = 0;
  EXPECT_NEAR(fitted_order(runs, 0.1, points), 2.0, 1e-12);
  EXPECT_EQ(points, 3);
  for (OrderPoint& run : runs) run.floor = 1.0;
  EXPECT_TRUE(std::isnan(fitted_order(runs, 2.0, points)));
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

std::vector<scene::Scene> walls(std::size_t count) {
  std::vector<scene::Scene> out;
  for (std::size_t k = 0; k < count; ++k) {
    scene::Scene scene = wall();
    scene.set_duration_s(4);
    scene.mutable_slave()->mutable_wall()->set_stiffness_nm_per_rad(1e3 *
                                                                    std::pow(10.0, 0.15 * static_cast<double>(k)));
    scene.mutable_control()->set_k_f_per_kgm2(200 + 5 * static_cast<double>(k));
    out.push_back(scene);
  }
  return out;
}

// The same numbers lane by lane as one run by itself, whoever runs beside it, however many threads there are.
TEST(Sweep, DoesNotDependOnThreadsOrNeighbours) {
  const std::vector<scene::Scene> scenes = walls(10);
  const auto scene_of = [&scenes](std::size_t k) { return scenes[k]; };
  const std::vector<SweepOutcome> one = sweep(scenes.size(), scene_of, 1);
  EXPECT_EQ(sweep(scenes.size(), scene_of, 2), one);
  EXPECT_EQ(sweep(scenes.size(), scene_of, 3), one);
  const std::vector<SweepOutcome> backwards = sweep(
      scenes.size(), [&scenes](std::size_t k) { return scenes[scenes.size() - 1 - k]; }, 1);
  for (std::size_t k = 0; k < scenes.size(); ++k) EXPECT_EQ(backwards[scenes.size() - 1 - k], one[k]) << k;
}

TEST(Sweep, LanesMoveAsTheRunByItself) {
  for (const char* name : {"four_channel_wall", "four_channel_cdob", "four_channel_cdob_sdcv", "zero_delay"}) {
    for (const bool ideal : {true, false}) {
      scene::Scene scene = load_scene(name).scene;
      scene.set_duration_s(6);
      if (ideal) {
        scene.mutable_master()->mutable_motor()->set_encoder_counts_per_rev(0);
        scene.mutable_slave()->mutable_motor()->set_encoder_counts_per_rev(0);
      }
      ASSERT_TRUE(LockStep::suits(scene));
      const auto lanes = make_lock_step({&scene, 1});
      lanes->run();
      const SweepOutcome o = lanes->outcomes().front();
      const auto run = make_bare_run(scene, {BareMethod::kClosedForm, 0, 0}, false);
      const Trajectory alone = run->record(ticks_of(scene) - 1);
      EXPECT_NEAR(o.x_s, alone.x_s.back(), ideal ? 1e-12 : 1e-3) << name;
      EXPECT_NEAR(o.x_m, alone.x_m.back(), ideal ? 1e-12 : 1e-3) << name;
    }
  }
}

TEST(Sweep, AllocatesNothingOnceItRuns) {
  if (kCounterIsBlind) GTEST_SKIP();
  const std::vector<scene::Scene> scenes = walls(LockStep::kScenes);
  const auto run = make_lock_step(scenes);
  const TouchCounter counter;
  run->run();
  EXPECT_EQ(counter.since(), Touched{});
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

// Theory within 0.2: free, soft contact, damped wall. Where a wall is too stiff for the steps to be small against its
// oscillation, terms of two orders mix; so 1e6 N m/rad is only held to converge.
TEST(NightlyPrecision, OrdersAreThoseOfTheory) {
  PrecisionSettings settings;
  settings.runs = 1;
  settings.competitor = settings.quantised = false;
  for (const char* name : {"zero_delay", "four_channel", "four_channel_wall"}) {
    for (const FittedOrder& fit : measure_precision(load_scene(name), settings).orders) {
      ASSERT_GE(fit.points, 2) << name << ' ' << name_of(fit.method);
      EXPECT_NEAR(fit.position, fit.theory, 0.2) << name << ' ' << name_of(fit.method);
    }
  }
  const std::vector<std::string> stiff = {"slave.wall.stiffness_nm_per_rad=1e6", "slave.wall.damping_nms_per_rad=63",
                                          "duration_s=5", "windows.contact.until_s=5"};
  for (const FittedOrder& fit : measure_precision(load_scene("four_channel_wall", stiff), settings).orders)
    EXPECT_GT(fit.position, fit.theory - 0.2) << name_of(fit.method);
}

}  // namespace
}  // namespace farhand
