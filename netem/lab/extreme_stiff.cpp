// Plants with fast and slow motions at once: bristles, springs, light bodies on heavy ones.
#include <cmath>

#include "common/config/schema.hpp"
#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"
#include "netem/lab/extreme_bounce.hpp"
#include "netem/lab/extreme_families.hpp"
#include "netem/lab/extreme_loop.hpp"
#include "netem/lab/extreme_plant.hpp"

namespace farhand::extreme {
namespace {

using BristlePlant = DirectSlavePlantWith<Friction::kBristle>;

// Breaks away, turns round, is held by less than it slides with, is let go.
double push(int tick) { return tick < 50 ? 0.1 : tick < 100 ? -0.15 : tick < 150 ? 0.04 : 0.0; }

LuGrePlan lugre(double sigma_0, double sigma_1) {
  LuGrePlan plan{.J = 0.004,
                 .sigma_0 = sigma_0,
                 .sigma_1 = sigma_1,
                 .sigma_2 = 0.002,
                 .F_c = 0.05,
                 .F_s = 0.07,
                 .v_s = 0.1,
                 .torques = {},
                 .seconds = 1e-3};
  for (int k = 0; k < 200; ++k) plan.torques.push_back(push(k));
  return plan;
}

template <class Scheme>
Case bristle_case(const std::string& name, double sigma_0, double sigma_1, double step, double within,
                  double energy_within) {
  return {"LuGre bristles", name, accurate(within), [=] {
            const LuGrePlan l = lugre(sigma_0, sigma_1);
            const auto exact = lugre_reference(l);
            PlantPlan<BristlePlant> plan;
            plan.params.motor = motor_of(l);
            plan.input = push;
            plan.settings.max_step = step;
            const SecondWay way = [&](int tick, double) { return exact[static_cast<std::size_t>(tick)][0]; };
            return outcome_of(run_stepping<Scheme>(plan, way), "Fehlberg 7(8), long double", energy_within);
          }};
}

void add_bristles(Cases& cases) {
  for (const double sigma_0 : {1e2, 1e3, 1e4, 1e5, 1e6}) {
    const double sigma_1 = std::sqrt(sigma_0 * 0.004);
    cases.push_back(bristle_case<DormandPrince>(shortest(sigma_0) + " N m/rad, adaptive pair", sigma_0, sigma_1, 0.5e-3,
                                                1e-7, 1e-6));
    cases.push_back(
        bristle_case<Sdirk2>(shortest(sigma_0) + " N m/rad, SDIRK2 at 50 us", sigma_0, sigma_1, 50e-6, 1e-4, 1e-2));
    cases[cases.size() - 1].quick = cases[cases.size() - 2].quick = sigma_0 < 1e5;
  }
  cases.push_back(
      bristle_case<DormandPrince>("1e4 N m/rad without damping of its own, adaptive pair", 1e4, 0, 0.5e-3, 1e-8, 1e-6));
  cases.push_back(
      {"LuGre bristles", "1e4 N m/rad, closed form", refused("the bristle's torque is multiplied by the speed"), [] {
         SessionPlan plan;
         plan.sets = {"slave.motor.lugre={sigma_0_nm_per_rad: 1e4}", "world.method=CLOSED_FORM"};
         return judge_session(run_session(plan));
       }});
}

using Elastic = SeriesElasticPlant;

struct ElasticSetup {
  double spring = 10, J = 0.004, viscous = 0.002, hand_k = 2, hand_b = 0.02;
};
double command(int tick) { return (tick / 25) % 2 == 0 ? 0.3 : -0.3; }

Case elastic_case(const std::string& family, const std::string& name, double within, ElasticSetup s,
                  double energy_within = 1e-7) {
  return {
      family, name, accurate(within), [=] {
        PlantPlan<Elastic> plan;
        plan.params.actuator = {
            .spring = s.spring, .J = s.J, .viscous = s.viscous, .joint_counts_per_rev = 0, .motor_counts_per_rev = 0};
        plan.params.environment.hand = Hand::Params{.stiffness = s.hand_k, .damping = s.hand_b, .from = -1};
        plan.input = command;
        plan.corners = {-0.5236, 0.5236};
        const long double J = s.J, drive = 2 * 3.14159265358979323846L * 30;
        const HeldFlow<4> flow({{{0, 1, 0, 0},
                                 {-(static_cast<long double>(s.spring) + s.hand_k) / J,
                                  -(static_cast<long double>(s.viscous) + s.hand_b) / J, s.spring / J, 0},
                                 {0, 0, 0, 1},
                                 {0, 0, 0, -drive}}},
                               1e-3L);
        std::array<long double, 4> x{};
        const SecondWay way = [&](int, double input) {
          flow.step(x, {0, 0, 0, drive * input});
          return static_cast<double>(x[0]);
        };
        return outcome_of(run_closed(plan, way), "matrix exponential, long double", energy_within);
      }};
}

void add_springs(Cases& cases) {
  for (const double spring : {1.0, 10.0, 100.0, 1e3, 1e4, 1e5})
    cases.push_back(elastic_case("springs", "series spring of " + shortest(spring) + " N m/rad, orthosis alone", 1e-12,
                                 {.spring = spring}));
  for (const char* spring : {"5", "10", "20", "40"}) {
    cases.push_back(session_case(
        "springs", std::string("series spring of ") + spring + " N m/rad, session with the MCU", accurate(kFrame),
        Sets{"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125", "duration_s=12",
             std::string("slave.series_elastic.spring_nm_per_rad=") + spring}));
  }
}

void add_ratios(Cases& cases) {
  for (const double ratio : {1e-4, 1e-3, 1e-2, 0.1, 10.0, 1e2, 1e3, 1e4}) {
    LoopPlan plan;
    plan.master.J = plan.master.J_n = 0.004 * ratio;
    plan.master.inertia = 0;
    plan.K_f = std::min(250.0, 1 / plan.master.J_n);
    plan.ticks = 1000;
    cases.push_back(
        loop_case("inertia ratios", "master to slave " + shortest(ratio) + ", bare loop", accurate(1e-9), plan));
  }
  for (const double ratio : {1e-4, 1e-2, 1e2}) {
    LoopPlan plan;
    plan.master.inertia = 0.004 * ratio;
    cases.push_back(
        loop_case("inertia ratios", "arm to motor " + shortest(ratio) + ", bare loop", accurate(1e-9), plan));
  }
}

}  // namespace

void add_stiff(Cases& cases) {
  add_bristles(cases);
  add_springs(cases);
  add_ratios(cases);
  for (const double J : {1e-6, 1e-8})
    cases.push_back(
        elastic_case("massless limits", "a joint of " + shortest(J) + " kg m2 on a series spring", 1e-11, {.J = J}));
}

}  // namespace farhand::extreme
