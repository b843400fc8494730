// Long runs, old clocks, starts at the stops, and numbers so small that they lose digits.
#include <cmath>

#include "common/config/schema.hpp"
#include "netem/lab/extreme_families.hpp"
#include "netem/lab/extreme_loop.hpp"
#include "netem/link_model.hpp"

namespace farhand::extreme {
namespace {

constexpr Nanoseconds kDay = 86'400 * kSecond;

// Gains that suit a period of 20 ms.
LoopPlan slow_loop() { return {.K_p = 25, .K_d = 10, .K_f = 50, .g_dis = 20, .g_reac = 20, .g_v = 50, .dt = 0.02}; }
Sets slow_session() {
  return {"tick_s=0.02",
          "control.K_p_per_s2=25",
          "control.K_d_per_s=10",
          "control.K_f_per_kgm2=50",
          "control.g_dis_rad_s=20",
          "control.g_reac_rad_s=20",
          "control.g_v_rad_s=50"};
}

// A peer whose clock gains 200 ppm, sending every 20 ms through jitter for a day; what is shown must be what it was
// when it was shown last.
Outcome receiver_for_a_day() {
  constexpr Nanoseconds kTick = 20 * kMillisecond;
  Receiver<1> receiver({.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond}, 1);
  LinkModel link({.delay_s = 0.05, .jitter_s = 0.02, .distribution = DelayDistribution::kUniform}, 3,
                 LinkDirection::kForward);
  Packet<1> waiting[8];
  Nanoseconds due[8];
  std::fill(std::begin(due), std::end(due), std::numeric_limits<Nanoseconds>::max());
  Outcome out;
  out.second_way = "the sine that was sent, at the moment shown";
  out.unit = "rad";
  out.budget = 5'000'000;
  out.error = 0;
  Nanoseconds age_low = std::numeric_limits<Nanoseconds>::max(), age_high = 0;
  const auto stamp = [](Nanoseconds t) { return 7 * kDay + t + t / 5000; };  // 200 ppm fast
  const auto angle = [](Nanoseconds content) {
    return 0.25 * std::sin(M_PI * to_seconds((content - 7 * kDay) % (2 * kSecond)));
  };
  std::uint32_t seq = 0;
  for (Nanoseconds t = 0; t < kDay; t += kTick) {
    Packet<1> packet{.session = 9, .seq = ++seq, .send_time_ns = stamp(t), .motion = {}};
    packet.motion.x[0] = angle(packet.send_time_ns);
    const std::size_t slot = seq % 8;
    waiting[slot] = packet;
    due[slot] = t + link.offer(t).delay;
    for (std::size_t k = 1; k <= 8; ++k) {
      const std::size_t s = (slot + k) % 8;
      if (due[s] > t) continue;
      receiver.accept(waiting[s], due[s]);
      due[s] = std::numeric_limits<Nanoseconds>::max();
    }
    const Played<1> shown = receiver.play(t);
    ++out.work;
    if (!shown.any || t < 30 * kSecond) continue;
    out.error = std::max(out.error, std::abs(shown.motion.x[0] - angle(shown.content_time)));
    const Nanoseconds age = stamp(t) - shown.content_time;
    age_low = std::min(age_low, age);
    age_high = std::max(age_high, age);
  }
  out.what = "shown between " + shortest(std::round(1e-6 * static_cast<double>(age_low))) + " and " +
             shortest(std::round(1e-6 * static_cast<double>(age_high))) + " ms after it was sent";
  return out;
}

void add_day(Cases& cases) {
  const std::string family = "24 h";
  LoopPlan loop = slow_loop();
  loop.ticks = 86'400 * 50;
  loop.meter = 0.3;  // it soon stands still
  cases.push_back(loop_case(family, "bare loop at 20 ms", accurate(1e-7), loop));
  cases.back().quick = false;
  Sets sets = slow_session();
  sets.insert(sets.end(), {"duration_s=86400", "slave.limits.session_s=1e5", "world.step_s=0.001"});
  SessionPlan plan;
  plan.sets = sets;
  plan.meter_s = 5e-3;
  plan.budget = 5'000'000;
  cases.push_back(session_case(family, "engaged session at 20 ms", accurate(1e-9), plan));
  cases.back().quick = false;
  cases.push_back({family, "receiver: 200 ppm and jitter, a packet every 20 ms",
                   accurate(0.25 * M_PI * M_PI / 8 * 4e-4 * 1.1), receiver_for_a_day, false});
  for (const auto& [name, epoch] :
       {std::pair{"a day", kDay}, {"ten years", 3650 * kDay}, {"a hundred years", 36'500 * kDay}}) {
    SessionPlan old;
    old.epoch = epoch;
    cases.push_back(session_case(family, std::string("clocks start at ") + name, accurate(1e-9), old));
  }
}

void add_starts(Cases& cases) {
  const std::string family = "start at the stops";
  const auto start = [&](const std::string& name, double master, double slave, Expected expected) {
    SessionPlan plan;
    // Nobody engages while the hand still swings from its stop to and fro.
    plan.sets = {"duration_s=16", "operator_acts[0].at_s=5"};
    plan.master_start = master;
    plan.slave_start = slave;
    plan.meter_s = 25e-6;
    plan.energy_within = 5e-3;  // what it costs to leave a stop falls into a piece of the balance
    cases.push_back(session_case(family, name, std::move(expected), plan));
  };
  start("master at its upper stop", 0.349, 0, accurate(1e-9));
  start("master at its lower stop", -0.349, 0, accurate(1e-9));
  start("slave at its upper stop", 0, 0.5236, accurate(1e-9));
  start("slave at its lower stop", 0, -0.5236, accurate(1e-9));
  start("both, at opposite stops", 0.349, -0.5236, accurate(1e-9));
  start("master 1 mrad inside its stop", 0.350, 0, accurate(1e-9));
  start("slave 0.1 rad inside its stop: thrown out", 0, 0.6236, accurate(1e-9));
}

void add_denormals(Cases& cases) {
  const std::string family = "denormals";
  // Each of the operations of a period rounds to a multiple of the least number there is; a filter with a/dt = 333/s
  // in it multiplies that.
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  const auto scaled = [&](double scale, double within) {
    LoopPlan plan;
    plan.master.rest = plan.master.start = scale;
    plan.slave.rest = 0;
    cases.push_back(
        loop_case(family, "bare loop, everything of the size " + shortest(scale) + " rad", accurate(within), plan));
  };
  scaled(1e-300, 1e-12);
  scaled(1e-308, 1e-12);
  scaled(1e-315, 1e3 * kLeast / 1e-315);
  scaled(1e-320, 1e3 * kLeast / 1e-320);
  const auto set = [&](const std::string& name, Sets sets, Expected expected) {
    cases.push_back(session_case(family, name, std::move(expected), std::move(sets)));
  };
  set("stiffness of the hand 1e-310 N m/rad", {"slave.hand.stiffness_nm_per_rad=1e-310"}, accurate(1e-9));
  set("delay 1e-310 s", both_ways({"delay_s=1e-310", "distribution=CONSTANT"}), accurate(1e-9));
  set("viscous friction 1e-310 N m s/rad",
      {"master.motor.viscous_nms_per_rad=1e-310", "master.axis.viscous_nms_per_rad=1e-310"}, accurate(1e-9));
  set("inertia of the motor 1e-310 kg m2", {"master.motor.J_kgm2=1e-310", "master.therapist.J_h_kgm2=0"},
      refused("master off: device lost", Block::kIntegrator));
}

}  // namespace

void add_faults(Cases& cases) {
  add_day(cases);
  add_starts(cases);
  add_denormals(cases);
}

}  // namespace farhand::extreme
