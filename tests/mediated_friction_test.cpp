// The mediator on devices with friction that no sensor tells from the hand: nothing hunts, and nothing is felt that is
// not there, with an empty sweep before and without.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "common/law/mediator.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/contact_cell.hpp"

namespace farhand {
namespace {

constexpr double kTick = 1e-3;

TEST(ContactModel, AReactionThatMayBeFrictionIsNoContact) {
  for (const double F_c : {0.02, 0.1, 0.3}) {
    ContactModel contact(250, kTick);
    // Slides to and fro with nothing in the device; what is taken off it as friction is late by a few milliradians.
    for (int k = 0; k < 20000; ++k) {
      const double x = 0.3 * std::sin(kTick * k), f = F_c * std::tanh(std::cos(kTick * k) / 0.02);
      contact.learn(x, f, 0.5 * f, {F_c, F_c}, x, Learns::kAll);
      ASSERT_EQ(contact.force(x, 0.0), 0.0) << F_c;
    }
    // A hand that pushes back with the friction and 0.05 N m is one.
    for (int k = 0; k < 500; ++k) contact.learn(0.3, 2 * F_c + 0.06, F_c + 0.06, {F_c, F_c}, 0.3, Learns::kAll);
    EXPECT_GT(contact.force(0.3, 0.0), 0.4 * F_c) << F_c;
  }
}

// The torque at which the model rests is that of the hand, but for the band, and without friction there is none.
TEST(ContactModel, RestsWithinABandOfTheFrictionThatWasSeen) {
  for (const double F_c : {0.0, 0.02, 0.05, 0.3}) {
    ContactModel contact(250, kTick);
    for (int k = 0; k < 10000; ++k) {
      const double x = 0.3 * std::min(1.0, kTick * k);
      contact.learn(x, 2 * x + F_c, 2 * x + F_c, {F_c, F_c}, x, Learns::kAll);
    }
    const double band = std::min(0.6 * F_c, 0.04);
    EXPECT_NEAR(contact.force(0.3, 0.0), 0.6 + F_c, band + 0.003) << F_c;
    // A change by less than the band moves nothing.
    const double before = contact.force(0.3, 0.0);
    std::mt19937 dice(3);
    std::uniform_real_distribution<double> within(-0.9 * band, 0.9 * band);
    for (int k = 0; k < 3000; ++k)
      contact.learn(0.3, before + within(dice), before + within(dice), {F_c, F_c}, 0.3, Learns::kAll);
    EXPECT_NEAR(contact.force(0.3, 0.0), before, 0.003) << F_c;
  }
}

struct Rested {
  bool stable = false;
  double residual_rad = 0, F_m = 0, F_s = 0, phantom_nm = 0, phantom_late_nm = 0;
};

// swept: the box measures its friction first, in 40 s with nothing in it.
Rested rested(const std::string& scene, const ContactCell& cell, bool constant, double F_c, bool swept) {
  LoadedScene loaded = load_scene(scene, cell, constant);
  scene::Scene& s = loaded.scene;
  if (scene.starts_with("sea")) {
    s.mutable_slave()->mutable_series_elastic()->set_tendon_friction_nm(F_c);
  } else {
    s.mutable_slave()->mutable_motor()->set_coulomb_nm(F_c);
  }
  if (swept) {
    constexpr double kLater_s = 40;
    s.set_duration_s(s.duration_s() + kLater_s);
    auto& first = *s.mutable_master()->mutable_therapist()->mutable_intended(0);
    first.set_duration_s(first.duration_s() + kLater_s);
    s.mutable_slave()->mutable_hand()->set_from_s(s.slave().hand().from_s() + kLater_s);
    for (scene::Window* window : {s.mutable_windows()->mutable_free(), s.mutable_windows()->mutable_contact()}) {
      window->set_from_s(window->from_s() + kLater_s);
      window->set_until_s(window->until_s() + kLater_s);
    }
    s.mutable_operator_acts(0)->set_at_s(s.operator_acts(0).at_s() + kLater_s);
    scene::OperatorAct sweep;
    sweep.set_at_s(0.2);
    sweep.set_act(scene::SWEEP);
    sweep.set_by(scene::PATIENT);
    *s.add_operator_acts() = sweep;
    s.mutable_operator_acts()->SwapElements(0, s.operator_acts_size() - 1);
  }
  const Session session = simulate(loaded);
  const Metrics metrics = compute_metrics(session, s);
  Rested out{.stable = metrics.is_true("stable") &&
                       session.master.back().state == static_cast<int>(StationState::kEngaged) &&
                       session.slave.back().state == static_cast<int>(StationState::kEngaged),
             .residual_rad = metrics.number("residual_p2p_rad"),
             .phantom_nm = metrics.number("phantom_peak_nm"),
             .phantom_late_nm = metrics.number("phantom_late_peak_nm")};
  const auto mean = [&](const std::vector<StationSample>& rows) {
    double sum = 0;
    int n = 0;
    for (const StationSample& row : rows) {
      if (row.t_s > s.duration_s() - 2) sum += row.true_f_nm, ++n;
    }
    return sum / n;
  };
  out.F_m = -mean(session.master);
  out.F_s = mean(session.slave);
  return out;
}

struct Judged {
  int sessions = 0, unstable = 0;
  double residual_rad = 0, phantom_nm = 0, off_nm = 0;
};

// may_hunt: the cell is one of those that are named below.
void judge(const std::string& scene, const ContactCell& cell, bool constant, double F_c, bool swept, Judged& all) {
  const Rested r = rested(scene, cell, constant, F_c, swept);
  const std::string where =
      scene + ", F_c " + std::to_string(F_c) + ", " + cell.name() + (constant ? ", constant" : ", jitter");
  const bool softest = cell.grip == "LIGHT" && cell.environment == "0.5";
  // Named: at 0.1 N m behind the MCU a light grip on the softest hand hunts over 0.1 s each way.
  const bool may_hunt = F_c > 0.09 && scene.starts_with("sea") && softest && cell.delay_s == 0.1;
  ++all.sessions;
  if (!r.stable) ++all.unstable;
  EXPECT_TRUE(r.stable || may_hunt) << where;
  if (!may_hunt) {
    EXPECT_LE(r.residual_rad, softest ? 8e-3 : 3e-3) << where;
    all.residual_rad = std::max(all.residual_rad, r.residual_rad);
  }
  EXPECT_LE(r.phantom_nm, 0.1) << where;
  all.phantom_nm = std::max(all.phantom_nm, r.phantom_nm);
  if (cell.environment == "free") return;
  EXPECT_NEAR(r.F_m, r.F_s, std::max(0.05 * r.F_s, F_c + 0.02)) << where;
  all.off_nm = std::max(all.off_nm, std::abs(r.F_m - r.F_s));
}

void print(const std::string& scene, double F_c, const Judged& all) {
  std::printf(
      "%s, friction %g N m: %d sessions, %d unstable, rest within %.2f mrad, phantom at most %.3f N m, steady force "
      "off by at most %.3f N m\n",
      scene.c_str(), F_c, all.sessions, all.unstable, 1e3 * all.residual_rad, all.phantom_nm, all.off_nm);
}

TEST(MediatedFriction, ALightGripOnASoftHandComesToRest) {
  for (const std::string scene : {"four_channel_mediated", "sea_four_channel_mediated"}) {
    for (const double F_c : {0.02, 0.05}) {
      Judged all;
      for (const char* hand : {"0.5", "2"}) {
        for (const bool constant : {true, false}) judge(scene, {0.1, hand, "LIGHT", 1}, constant, F_c, false, all);
      }
      print(scene, F_c, all);
    }
  }
}

TEST(MediatedFriction, NothingIsFeltInAnEmptyDeviceOfAnyFrictionThatWasSwept) {
  for (const std::string scene : {"four_channel_mediated", "sea_four_channel_mediated"}) {
    for (const double F_c : {0.0, 0.1, 0.3}) {
      Judged all;
      for (const char* grip : {"NORMAL", "FIRM"}) judge(scene, {0.1, "free", grip, 1}, false, F_c, true, all);
      print(scene, F_c, all);
    }
  }
}

TEST(NightlyMediatedFriction, EveryCellBehindTheMcuAndOnADirectDrive) {
  for (const std::string scene : {"sea_four_channel_mediated", "four_channel_mediated"}) {
    for (const double F_c : {0.0, 0.02, 0.05, 0.1}) {
      if (F_c > 0.09 && !scene.starts_with("sea")) continue;
      Judged all;
      for (const bool constant : {true, false}) {
        each_contact_cell({0.02, 0.1, 0.3, 0.5}, 5, true,
                          [&](const ContactCell& cell) { judge(scene, cell, constant, F_c, false, all); });
      }
      print(scene, F_c, all);
    }
  }
}

}  // namespace
}  // namespace farhand
