// Whether a hit on a wall dies out, found by doing it.
#include "common/advice/hammering.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "common/advice/scene_loops.hpp"
#include "common/analysis/bisect.hpp"
#include "common/config/schema.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/said_at_load.hpp"

namespace farhand {
namespace {

const std::string kHit = R"(
architecture: FOUR_CHANNEL duration_s: 9 operator_acts { at_s: 0.5 act: ENGAGE }
network { forward { delay_s: 0.1 } backward { delay_s: 0.1 } }
master { axis { torque_rate_limit_nm_per_s: 1e6 } motor { encoder_counts_per_rev: 0 }
         therapist { intended { duration_s: 2 } intended { ramp_to_rad: 0.25 duration_s: 0.3 } } }
slave { shaking_limit_rad_s: 100 limits { power_w: 1000 }
        axis { torque_rate_limit_nm_per_s: 1e6 } motor { encoder_counts_per_rev: 0 } wall { at_rad: 0.1 } }
)";

// How far the slave moves to and fro at the end, rad, after the worst of some hits.
double left_of_hits(const auto& loaded) {
  double most = 0;
  for (const char* ramp : {"0.2", "0.3", "0.5"}) {
    const Session session = simulate(loaded(ramp));
    double low = 1e9, high = -1e9;
    for (const StationSample& s : session.slave)
      if (s.t_s > session.slave.back().t_s - 1) low = std::min(low, s.true_x_rad), high = std::max(high, s.true_x_rad);
    most = std::max(most, high - low);
  }
  return most;
}

// Whole sessions, a seventh below and above the bound, which knows the slave alone. Not every hit is caught by the
// motion that goes on.
TEST(Warnings, SomeHitHammersOnBeyondTheBoundAndNoneBelow) {
  for (const auto& [k, b] : {std::pair(1e3, 0.4), std::pair(1e4, 1.26), std::pair(1e5, 4.0), std::pair(1e5, 0.8)})
    for (const double J_n : {0.004, 0.008}) {
      const auto with = [&](double K_f, const std::string& ramp_s) {
        return load(kHit, {"master.therapist.intended[1].duration_s=" + ramp_s,
                           "slave.wall.stiffness_nm_per_rad=" + shortest(k), "control.K_f_per_kgm2=" + shortest(K_f),
                           "slave.wall.damping_nms_per_rad=" + shortest(b), "slave.axis.J_n_kgm2=" + shortest(J_n)});
      };
      scene::Scene tried = with(100, "0.3").scene;
      const Contact contact = contacts(tried).back();
      const double bound = first_failure(
          [&](double K_f) {
            tried.mutable_control()->set_k_f_per_kgm2(K_f);
            return hits_die_out(tried, contact);
          },
          50, 1000, 1.2, 8);
      const double below = left_of_hits([&](const char* ramp) { return with(bound / 1.15, ramp); });
      const double above = left_of_hits([&](const char* ramp) { return with(bound * 1.15, ramp); });
      std::printf("k %g b %g J_n %g: K_f %.0f, K_f J_n %.2f; below %.1e rad, above %.1e rad\n", k, b, J_n, bound,
                  bound * J_n, below, above);
      EXPECT_LT(below, 1e-6);
      EXPECT_GT(above, 1e-3);
      EXPECT_EQ(said(with(bound / 1.01, "0.3")).find("a hit"), std::string::npos);
      EXPECT_NE(said(with(bound * 1.01, "0.3")).find("a hit"), std::string::npos);
    }
}

}  // namespace
}  // namespace farhand
