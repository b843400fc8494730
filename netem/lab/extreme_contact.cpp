// Walls from soft to nearly rigid, contacts shorter than a step, several in one tick, and axes without damping or
// without mass: the plant alone, by its default method, beside the bouncing mass in long double.
#include <cmath>

#include "common/config/schema.hpp"
#include "common/plant/axis_plant.hpp"
#include "netem/lab/extreme_bounce.hpp"
#include "netem/lab/extreme_families.hpp"
#include "netem/lab/extreme_loop.hpp"
#include "netem/lab/extreme_plant.hpp"

namespace farhand::extreme {
namespace {

using P = DirectSlavePlant;

struct Hit {
  double J = 0.004, viscous = 0.002;
  double k = 1e4, b = 0, at = 0.1;  // the wall
  double stop_min = -0.5236, stop_max = 0.5236;
  double x = 0, v = 1, torque = 0.5;
  double tick_s = 1e-3;
  int ticks = 200;
};

PlantPlan<P> plan_of(const Hit& hit) {
  PlantPlan<P> plan;
  plan.params.motor = {.J = hit.J,
                       .viscous = hit.viscous,
                       .encoder_counts_per_rev = 0,
                       .stop_min = hit.stop_min,
                       .stop_max = hit.stop_max};
  plan.params.load.wall = Wall::Params{.stiffness = hit.k, .damping = hit.b, .at = hit.at};
  plan.start = {hit.x, hit.v};
  plan.input = [torque = hit.torque](int) { return torque; };
  plan.corners = {hit.at, hit.stop_min, hit.stop_max};
  plan.tick_s = hit.tick_s;
  plan.ticks = hit.ticks;
  return plan;
}

// The stops as the plant documents them: 3000 N m/rad, half of critical damping.
SecondWay second_way_of(const Hit& hit) {
  const double k = 3000, b = std::sqrt(k * hit.J);
  auto bounce = std::make_shared<Bounce>(
      hit.J, hit.viscous,
      std::vector<Bounce::Contact>{{hit.k, hit.b, hit.at, 1}, {k, b, hit.stop_max, 1}, {k, b, hit.stop_min, -1}}, hit.x,
      hit.v);
  return [bounce, tick_s = hit.tick_s](int, double torque) {
    bounce->advance(torque, tick_s);
    return bounce->x();
  };
}

const char* const kBounce = "bouncing mass, long double";

Case closed(const std::string& family, const std::string& name, double within, const Hit& hit,
            double energy_within = 1e-6) {
  return {family, name, accurate(within),
          [=] { return outcome_of(run_closed(plan_of(hit), second_way_of(hit)), kBounce, energy_within); }};
}
template <class Scheme>
Case stepped(const std::string& family, const std::string& name, double within, Hit hit, double step,
             double energy_within) {
  return {family, name, accurate(within), [=] {
            PlantPlan<P> plan = plan_of(hit);
            plan.settings.max_step = step;
            return outcome_of(run_stepping<Scheme>(plan, second_way_of(hit)), kBounce, energy_within);
          }};
}

double damping(double ratio, double k, double J = 0.004) { return 2 * ratio * std::sqrt(k * J); }

void add_walls(Cases& cases) {
  for (const double k : {1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
    for (const double ratio : {0.0, 0.1, 0.7, 1.0, 2.0}) {
      Hit hit{.k = k, .b = damping(ratio, k)};
      cases.push_back(
          closed("walls", "wall of " + shortest(k) + " N m/rad, damping ratio " + shortest(ratio), 1e-10, hit));
    }
  }
}

void add_short_contacts(Cases& cases) {
  const std::string one = "contact within one step";
  for (const double k : {1e6, 1e7, 1e8}) {
    const Hit hit{.k = k, .b = damping(0.05, k), .v = 3, .torque = 0, .ticks = 60};
    const double contact_us = 1e6 * M_PI / std::sqrt(k / 0.004);
    const std::string name = "closed form over ticks of 1 ms, contact of " + shortest(std::round(contact_us)) + " us";
    cases.push_back(closed(one, name, 1e-11, hit));
    cases.push_back(stepped<DormandPrince>(one, "adaptive pair, contact of " + shortest(std::round(contact_us)) + " us",
                                           1e-8, hit, 0.5e-3, 1e-8));
  }
  Hit slow{.k = 1e4, .b = damping(0.05, 1e4), .v = 3, .torque = 0, .tick_s = 0.02, .ticks = 5};
  cases.push_back(closed(one, "closed form over ticks of 20 ms, contact of 2 ms", 1e-11, slow));

  const std::string two = "two contacts in one tick";
  cases.push_back(
      closed(two, "wall and stop 0.1 mrad apart at 5 rad/s", 1e-10, {.k = 1e4, .b = 1.26, .stop_max = 0.1001, .v = 5}));
  cases.push_back(
      closed(two, "wall and stop at the same angle", 1e-10, {.k = 1e4, .b = 1.26, .stop_max = 0.1, .v = 5}));
  cases.push_back(closed(two, "a rigid wall hit twice within a millisecond", 1e-10,
                         {.k = 1e8, .b = damping(0.02, 1e8), .x = 0.09999, .v = 0.1, .torque = 3}));
  cases.push_back(closed(two, "rattling between stops 2 mrad apart at 10 rad/s", 1e-9,
                         {.k = 1, .at = 0.9, .stop_min = -0.001, .stop_max = 0.001, .v = 10, .torque = 0}));
  cases.push_back(closed(two, "ticks of 20 ms, a rigid wall that is hit again and again", 1e-10,
                         {.k = 1e7, .b = damping(0.05, 1e7), .v = 1, .torque = 3, .tick_s = 0.02, .ticks = 20}));
  cases.push_back(closed(two, "at rest on the border, pressed in", 1e-12,
                         {.k = 1e6, .b = damping(0.5, 1e6), .x = 0.1, .v = 0, .torque = 1}));
  cases.push_back(closed(two, "at rest on the border, drawn out", 1e-12,
                         {.k = 1e6, .b = damping(0.5, 1e6), .x = 0.1, .v = 0, .torque = -1}));
}

void add_undamped(Cases& cases) {
  const std::string family = "zero damping";
  cases.push_back(closed(family, "100 s between a rigid wall and a stop without torque", 1e-8,
                         {.viscous = 0, .k = 1e7, .b = 0, .v = 0.5, .torque = -0.05, .tick_s = 0.02, .ticks = 500}));
  LoopPlan loop;
  for (LoopSide* side : {&loop.master, &loop.slave}) side->viscous = side->viscous_n = side->damping = 0;
  cases.push_back(loop_case(family, "bare loop, no friction and no damping anywhere", accurate(1e-10), loop));
  cases.push_back(bounded_case(
      family, "session, no friction and no damping anywhere", kStops,
      "nothing but the arm damps the master: without that it swings between the limits",
      Sets{"master.motor.viscous_nms_per_rad=0", "master.axis.viscous_nms_per_rad=0",
           "slave.motor.viscous_nms_per_rad=0", "slave.axis.viscous_nms_per_rad=0", "slave.hand.damping_nms_per_rad=0",
           "master.therapist.grip=CUSTOM", "master.therapist.B_h_nms_per_rad=0", "duration_s=9"}));
  for (const double k : {2.0, 1e3, 1e6}) {
    cases.push_back({family, "an undamped swing of " + shortest(std::round(std::sqrt(k / 0.004))) + " rad/s for 100 s",
                     accurate(1e-9 * std::max(1.0, k / 1e3)), [k] {
                       PlantPlan<P> plan;
                       plan.params.motor = {.viscous = 0, .encoder_counts_per_rev = 0, .stop_min = -7, .stop_max = 7};
                       plan.params.load.hand = Hand::Params{.stiffness = k, .damping = 0, .from = -1};
                       plan.start = {0.1, 0.0};
                       plan.ticks = k > 1e5 ? 10'000 : 100'000;
                       const SecondWay cosine = [&](int tick, double) {
                         return static_cast<double>(0.1L * std::cos(std::sqrt(static_cast<long double>(k) / 0.004) *
                                                                    (static_cast<long double>(tick + 1) * 1e-3)));
                       };
                       return outcome_of(run_closed(plan, cosine), "cosine", 1e-9);
                     }});
  }
}

void add_massless(Cases& cases) {
  const std::string family = "massless limits";
  for (const double J : {1e-5, 1e-7, 1e-9}) {
    cases.push_back(closed(family, "an axis of " + shortest(J) + " kg m2 pressed into a damped wall", 1e-10,
                           {.J = J, .viscous = 0.002, .k = 1e4, .b = 1.26, .x = 0.09, .v = 0, .torque = 0.5}));
  }
  cases.push_back(session_case(family, "an arm without inertia", accurate(1e-9), Sets{"master.therapist.J_h_kgm2=0"}));
  cases.push_back(session_case(family, "motors without inertia", refused("J_kgm2 = 0 is not allowed"),
                               Sets{"master.motor.J_kgm2=0"}));
}

}  // namespace

void add_contact(Cases& cases) {
  add_walls(cases);
  add_short_contacts(cases);
  add_undamped(cases);
  add_massless(cases);
}

}  // namespace farhand::extreme
