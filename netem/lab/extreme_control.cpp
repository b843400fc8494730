// The laws at and beyond the edges of their settings: control periods, cut-offs, gains, wrong inertia, saturation,
// coarse and fine encoders.
#include <cmath>

#include "common/config/schema.hpp"
#include "netem/lab/extreme_families.hpp"
#include "netem/lab/extreme_loop.hpp"

namespace farhand::extreme {
namespace {

// The laws are those of 1 ms; from some period on they cannot be stable, whatever the rest does.
void add_periods(Cases& cases) {
  const std::string family = "control periods";
  for (const double ms : {0.125, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0}) {
    LoopPlan plan{.dt = ms * 1e-3, .ticks = static_cast<std::uint64_t>(3000 / ms)};
    cases.push_back(loop_case(family, shortest(ms) + " ms, bare loop", accurate(1e-10), plan));
    const Sets sets{"tick_s=" + shortest(ms * 1e-3)};
    if (ms < 10) {
      cases.push_back(session_case(family, shortest(ms) + " ms, session", accurate(1e-9), sets));
    } else {
      cases.push_back(bounded_case(family, shortest(ms) + " ms, session", kStops,
                                   "the bare loop has its spectral radius above 1: it swings between the limits",
                                   sets));
    }
  }
  cases.push_back(session_case(family, "50 us, session", refused("tick_s = 5e-5 is not allowed"), Sets{"tick_s=5e-5"}));
}

void add_cutoffs(Cases& cases) {
  const std::string family = "cut-offs";
  for (const double g : {1.0, 10.0, 100.0, 1000.0, 3141.6, 1e4, 1e5, 1e7}) {
    const LoopPlan plan{.g_dis = g, .g_reac = g, .g_v = std::max(g, 100.0)};
    cases.push_back(loop_case(family, "all observers at " + shortest(g) + " rad/s, g dt " + shortest(g * 1e-3),
                              accurate(1e-11), plan));
  }
  for (const double g : {1.0, 10.0, 1e5}) {
    cases.push_back(loop_case(family, "velocity filter at " + shortest(g) + " rad/s", accurate(1e-11), {.g_v = g}));
    const std::string name = "CDOB at " + shortest(g) + " rad/s";
    const Sets sets{"architecture=FOUR_CHANNEL_CDOB", "duration_s=14", "control.g_net_rad_s=" + shortest(g)};
    if (g > 1000) {
      cases.push_back(session_case(family, name, accurate(1e-9), sets));
    } else {
      cases.push_back(bounded_case(
          family, name, kStops, "the compensation lags the loop that it closes: it swings between the limits", sets));
    }
  }
  for (const char* field : {"g_dis", "g_v"}) {
    cases.push_back(session_case(family, std::string(field) + " of 1e5 rad/s, a hundred times the control rate",
                                 accurate(1e-9), Sets{std::string("control.") + field + "_rad_s=1e5"}));
  }
  LoopPlan unfiltered{.g_reac = 1e5};
  cases.push_back(loop_case(family, "g_reac of 1e5 rad/s alone, bare loop", accurate(1e-10), unfiltered));
  cases.push_back(bounded_case(family, "g_reac of 1e5 rad/s alone, session", kStops,
                               "the bare loop has its spectral radius above 1: it swings between the limits",
                               Sets{"control.g_reac_rad_s=1e5"}));
  cases.push_back(session_case(family, "g_dis of 0 rad/s", refused("control.g_dis_rad_s = 0 is not allowed"),
                               Sets{"control.g_dis_rad_s=0"}));
}

void add_gains(Cases& cases) {
  const std::string family = "gains at and over 1/J_n";
  for (const double times : {0.1, 0.5, 1.0, 1.5, 2.0, 4.0, 10.0}) {
    LoopPlan stiff{.K_f = times * 250};
    stiff.slave.stiffness = 1000, stiff.slave.damping = 0.4;
    cases.push_back(
        loop_case(family, "K_f " + shortest(times) + "/J_n on a spring of 1000 N m/rad", accurate(1e-9), stiff));
  }
  for (const double K_p : {0.0, 1e4, 1e6})
    cases.push_back(loop_case(family, "K_p " + shortest(K_p), accurate(1e-10), {.K_p = K_p}));
  for (const double times : {1.0, 2.0, 4.0}) {
    const std::string name = "K_f " + shortest(times) + "/J_n, session on a wall of 1000 N m/rad";
    const Sets sets{"control.K_f_per_kgm2=" + shortest(times * 250),
                    "slave.hand={stiffness_nm_per_rad: 0 damping_nms_per_rad: 0}",
                    "slave.wall={stiffness_nm_per_rad: 1000 damping_nms_per_rad: 0.4 at_rad: 0.1}", "duration_s=9"};
    SessionPlan plan;
    plan.sets = sets;
    plan.meter_s = 25e-6;
    plan.energy_within = 1e-3;  // where it touches
    if (times < 2) {
      cases.push_back(session_case(family, name, accurate(1e-9), plan));
    } else {
      cases.push_back(bounded_case(family, name, kStops, "a stiff contact with more than the bare loop allows", sets));
    }
  }
}

void add_inertia(Cases& cases) {
  const std::string family = "J_n wrong";
  for (const double times : {0.3, 0.5, 0.7, 1.3, 1.5, 2.0, 3.0}) {
    LoopPlan plan;
    plan.master.J_n = plan.slave.J_n = times * 0.004;
    const std::string name = "J_n " + shortest(times) + " J";
    cases.push_back(loop_case(family, name + ", bare loop", accurate(1e-10), plan));
    const Sets sets{"duration_s=9", "master.axis.J_n_kgm2=" + shortest(times * 0.004),
                    "slave.axis.J_n_kgm2=" + shortest(times * 0.004)};
    if (times < 1.5) {
      cases.push_back(session_case(family, name + ", session", accurate(1e-9), sets));
    } else {
      cases.push_back(bounded_case(family, name + ", session", kStops,
                                   "the bare loop has its spectral radius above 1: it swings between the limits",
                                   sets));
    }
  }
}

void add_encoders(Cases& cases) {
  for (const int bits : {8, 10, 12, 14, 16, 18, 20, 24}) {
    const double counts = std::exp2(bits);
    cases.push_back(session_case("encoders", std::to_string(bits) + " bits a revolution", accurate(2 * 6.2832 / counts),
                                 Sets{"duration_s=9", "master.motor.encoder_counts_per_rev=" + shortest(counts),
                                      "slave.motor.encoder_counts_per_rev=" + shortest(counts)}));
  }
}

// An axis that is asked for more than it may give holds its limit: the slave presses with it, and so does the master,
// wherever the laws would like them to be.
Case torque_limit(double limit) {
  return {"torque, speed and encoder saturation", "torque limit " + shortest(limit) + " N m", accurate(1e-9), [limit] {
            SessionPlan plan;
            plan.sets = {"master.therapist.grip=FIRM", "slave.hand.stiffness_nm_per_rad=5", "duration_s=9",
                         "master.axis.torque_limit_nm=" + shortest(limit),
                         "slave.axis.torque_limit_nm=" + shortest(limit)};
            const SessionRecord record = run_session(plan);
            const double A = 0.3, K_h = 10, k = 5;
            Outcome out = judge_session(record, A - limit / K_h, limit / k, "statics under the limit");
            if (std::max(record.master.command_most, record.slave.command_most) > limit) out.error = Outcome::kNan;
            return out;
          }};
}

}  // namespace

void add_saturation(Cases& cases) {
  const std::string family = "torque, speed and encoder saturation";
  for (const double limit : {0.01, 0.1, 0.3, 0.6}) cases.push_back(torque_limit(limit));
  for (const double rate : {1.0, 10.0, 100.0, 1e6}) {
    cases.push_back(session_case(family, "torque may change by " + shortest(rate) + " N m/s", accurate(1e-9),
                                 Sets{"duration_s=12", "master.axis.torque_rate_limit_nm_per_s=" + shortest(rate),
                                      "slave.axis.torque_rate_limit_nm_per_s=" + shortest(rate)}));
  }
  for (const double speed : {0.02, 0.1, 0.5, 4.0}) {
    cases.push_back(session_case(family, "orthosis: motor no faster than " + shortest(speed) + " rad/s",
                                 accurate(kFrame),
                                 Sets{"duration_s=20", "slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125",
                                      "slave.series_elastic.motor_speed_limit_rad_s=" + shortest(speed)}));
    cases.push_back(session_case(family, "orthosis: reference no faster than " + shortest(speed) + " rad/s",
                                 accurate(kFrame),
                                 Sets{"duration_s=20", "slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125",
                                      "slave.axis.velocity_limit_rad_s=" + shortest(speed)}));
  }
}

void add_control(Cases& cases) {
  add_periods(cases);
  add_cutoffs(cases);
  add_gains(cases);
  add_inertia(cases);
  add_encoders(cases);
}

}  // namespace farhand::extreme
