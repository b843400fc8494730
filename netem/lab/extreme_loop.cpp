#include "netem/lab/extreme_loop.hpp"

#include <cmath>
#include <deque>

#include "common/config/schema.hpp"
#include "common/integrate/eigenvalues.hpp"
#include "common/plant/world.hpp"
#include "netem/lab/bare_law.hpp"
#include "netem/lab/extreme_probe.hpp"

namespace farhand::extreme {
namespace {

using Long = long double;

// J x'' = tau - D x' - k (x - rest), tau held for h: exact, and exact too where k or D is 0.
class ExactOscillator {
 public:
  ExactOscillator(const LoopSide& s, Long h) {
    const Long J = static_cast<Long>(s.J) + static_cast<Long>(s.inertia), k = s.stiffness;
    const Long D = static_cast<Long>(s.viscous) + static_cast<Long>(s.damping);
    const Long a = D / (2 * J), w2 = k / J - a * a;
    // x'' + 2 a x' + (k/J) x = u: with C = cos-like, S = sin-like/w of the damped motion.
    Long C, S;
    const Long e = std::exp(-a * h);
    if (w2 > 0) {
      const Long w = std::sqrt(w2);
      C = e * std::cos(w * h), S = e * std::sin(w * h) / w;
    } else if (w2 < 0) {  // e^-ah cosh(rh) without overflow
      const Long r = std::sqrt(-w2), p = std::exp((r - a) * h), m = std::exp((-r - a) * h);
      C = (p + m) / 2, S = (p - m) / (2 * r);
    } else {
      C = e, S = e * h;
    }
    xx_ = C + a * S, xv_ = S, vx_ = -(k / J) * S, vv_ = C - a * S;
    // A constant acceleration u adds its particular solution.
    if (k > 0) {
      xu_ = (1 - xx_) / (k / J), vu_ = S;
    } else if (D > 0) {
      const Long c = D / J;
      xu_ = (h + std::expm1(-c * h) / c) / c, vu_ = -std::expm1(-c * h) / c;
    } else {
      xu_ = h * h / 2, vu_ = h;
    }
    per_torque_ = 1 / J;
    rest_pull_ = k * static_cast<Long>(s.rest);
  }
  void step(Long& x, Long& v, Long torque) const {
    const Long u = (torque + rest_pull_) * per_torque_;
    const Long x0 = x;
    x = xx_ * x0 + xv_ * v + xu_ * u;
    v = vx_ * x0 + vv_ * v + vu_ * u;
  }

 private:
  Long xx_, xv_, vx_, vv_, xu_, vu_, per_torque_, rest_pull_;
};

using Sent = farhand::Sent<Long>;

// One side by hand, after Daud 2011, B.1-B.10 and 5.10-5.11, with backward Euler in every filter.
struct ExactSide {
  ExactSide(const LoopPlan& p, const LoopSide& s)
      : plant(s, p.dt),
        J_n(s.J_n),
        D_n(s.viscous_n),
        g_d(p.g_dis),
        g_r(p.g_reac),
        dt(p.dt),
        K_p(p.K_p),
        K_d(p.K_d),
        K_f(p.K_f),
        a_v(share(p.g_v)),
        a_d(share(p.g_dis)),
        a_r(share(p.g_reac)),
        x(s.start),
        y(s.start) {}

  Sent observe() {
    const Long v_now = a_v / dt * (x - y);
    y += a_v * (x - y);
    dis += a_d * (tau + J_n * g_d * v_now - dis);
    reac += a_r * (tau - D_n * v_now + J_n * g_r * v_now - reac);
    own = Sent{x, v_now, reac - J_n * g_r * v_now};
    return own;
  }
  void act(const Sent& peer) {
    const Long a_ref = K_p * (peer.x - own.x) + K_d * (peer.v - own.v) - K_f * (own.f + peer.f);
    tau = J_n * a_ref + dis - J_n * g_d * own.v;
    plant.step(x, v, tau);
  }
  Long share(Long g) const { return g * dt / (1 + g * dt); }

  ExactOscillator plant;
  Long J_n, D_n, g_d, g_r, dt, K_p, K_d, K_f, a_v, a_d, a_r;
  Long x, v = 0, y, dis = 0, reac = 0, tau = 0;
  Sent own;
};

struct ExactLoop {
  explicit ExactLoop(const LoopPlan& p)
      : master(p, p.master),
        slave(p, p.slave),
        to_slave(length(p), {p.master.start, 0, 0}),
        to_master(length(p), {p.slave.start, 0, 0}) {}
  static std::size_t length(const LoopPlan& p) { return static_cast<std::size_t>(p.delay_ticks); }

  void period() {
    to_slave.push_back(master.observe());
    to_master.push_back(slave.observe());
    master.act(to_master.front());
    slave.act(to_slave.front());
    to_slave.pop_front();
    to_master.pop_front();
  }
  ExactSide master, slave;
  std::deque<Sent> to_slave, to_master;

  // Everything that one period hands to the next.
  template <class Visit>
  void each_state(Visit&& visit) {
    for (ExactSide* side : {&master, &slave})
      visit(side->x), visit(side->v), visit(side->y), visit(side->dis), visit(side->reac), visit(side->tau);
    for (std::deque<Sent>* way : {&to_slave, &to_master}) {
      for (Sent& sent : *way) visit(sent.x), visit(sent.v), visit(sent.f);
    }
  }
};

ControlParams scene_params(const LoopPlan& p, const LoopSide& s) {
  ControlParams out;
  out.drive.model = {
      .J_n = s.J_n, .K_tn = 0.15, .viscous = s.viscous_n, .coulomb = 0, .gravity = 0, .gravity_angle = 0};
  out.drive.K = {.K_p = p.K_p, .K_d = p.K_d, .K_f = p.K_f};
  out.drive.g_dis = Cutoff::rad_s(p.g_dis);
  out.drive.g_reac = Cutoff::rad_s(p.g_reac);
  out.drive.g_v = Cutoff::rad_s(p.g_v);
  out.drive.gate = {.torque = 1e300, .torque_rate = 1e300, .velocity = 1e300, .range_min = -1e300, .range_max = 1e300};
  out.drive.take_over_s = p.dt * 1e-3;  // all of the law from the first tick
  out.drive.dt_s = p.dt;
  return out;
}

MotorAxis::Params motor_params(const LoopSide& s) {
  return {.J = s.J,
          .viscous = s.viscous,
          .gravity = 0,
          .gravity_angle = 0,
          .encoder_counts_per_rev = s.encoder_counts_per_rev,
          .stop_min = -1e6,
          .stop_max = 1e6};
}

MasterPlant::Params master_params(const LoopPlan& p) {
  return {.motor = motor_params(p.master),
          .load = {.K_h = p.master.stiffness, .B_h = p.master.damping, .J_h = p.master.inertia, .intended = {}},
          .start = p.master.rest};
}
DirectSlavePlant::Params slave_params(const LoopPlan& p) {
  return {.motor = motor_params(p.slave),
          .load = {.hand = Hand::Params{.stiffness = p.slave.stiffness,
                                        .damping = p.slave.damping,
                                        .rest = p.slave.rest,
                                        .from = -1e9,
                                        .until = 1e18},
                   .wall = std::nullopt},
          .start = p.slave.start};
}

}  // namespace

double spectral_radius(const LoopPlan& plan) {
  LoopPlan still = plan;  // without what acts from outside, so that one period is a matrix
  for (LoopSide* side : {&still.master, &still.slave}) side->rest = side->start = 0;
  int count = 0;
  ExactLoop(still).each_state([&](Long&) { ++count; });
  const auto size = static_cast<std::size_t>(count);
  std::vector<double> A(size * size);  // column by column: the transposed has the same eigenvalues
  for (int column = 0; column < count; ++column) {
    ExactLoop loop(still);
    int k = 0;
    loop.each_state([&](Long& value) { value = k++ == column ? 1 : 0; });
    loop.period();
    k = 0;
    loop.each_state(
        [&](Long& value) { A[static_cast<std::size_t>(column * count + k++)] = static_cast<double>(value); });
  }
  return std::abs(fastest_eigenvalue(A, size));
}

Outcome run_loop(const LoopPlan& plan) {
  Outcome out;
  out.second_way = "long double, exact between samples";
  out.unit = "relative";
  out.budget = 10'000'000;
  Watch watch;
  EnergyMeter energy[2];
  MasterWorld master_world(master_params(plan));
  DirectSlaveWorld slave_world(slave_params(plan));
  MasterPlant master_plant(master_params(plan));
  DirectSlavePlant slave_plant(slave_params(plan));
  const auto master = make_block_law("FOUR_CHANNEL", scene_params(plan, plan.master)),
             slave = make_block_law("FOUR_CHANNEL", scene_params(plan, plan.slave));
  ExactLoop exact(plan);
  using Heard = std::deque<farhand::Sent<double>>;
  Heard to_slave(ExactLoop::length(plan), {plan.master.start, 0, 0}),
      to_master(ExactLoop::length(plan), {plan.slave.start, 0, 0});
  const auto sensed = [&](const auto& world) {
    watch.see(Block::kIntegrator, world.true_x());
    watch.see(Block::kIntegrator, world.true_v());
    const double x = world.encoder();
    watch.see(Block::kEncoder, x);
    return x;
  };
  master->reset(sensed(master_world), {plan.slave.start, 0, 0});
  slave->reset(sensed(slave_world), {plan.master.start, 0, 0});
  const auto follow = [&](auto& law, const farhand::Sent<double>& remote) {
    const double torque = law->follow(remote);
    watch.command(torque);
    return torque;
  };
  double fastest = 1 / plan.dt;
  for (const LoopSide* side : {&plan.master, &plan.slave}) {
    const double J = side->J + side->inertia;
    fastest = std::max({fastest, std::sqrt(side->stiffness / J), (side->viscous + side->damping) / J});
  }
  const int pieces = 2 * std::max(2, static_cast<int>(std::ceil(plan.dt * fastest / plan.meter)));
  double largest = 0, worst = 0;
  std::uint64_t k = 0;
  for (; k < plan.ticks; ++k) {
    const double t0 = static_cast<double>(k) * plan.dt, t1 = static_cast<double>(k + 1) * plan.dt;
    to_slave.push_back(master->observe(sensed(master_world)));
    to_master.push_back(slave->observe(sensed(slave_world)));
    energy[0].advance(master_world, master_plant, follow(master, to_master.front()), t0, t1, pieces);
    energy[1].advance(slave_world, slave_plant, follow(slave, to_slave.front()), t0, t1, pieces);
    to_slave.pop_front();
    to_master.pop_front();
    exact.period();
    const double x_m = static_cast<double>(exact.master.x), x_s = static_cast<double>(exact.slave.x);
    largest = std::max({largest, std::abs(x_m), std::abs(x_s)});
    worst = std::max(
        {worst, std::abs(master_world.true_x() - x_m) / largest, std::abs(slave_world.true_x() - x_s) / largest});
    if (largest > 1e5) break;
  }
  const double radius = plan.delay_ticks <= 100 ? spectral_radius(plan) : Outcome::kNan;
  const auto words = [](double y) {
    return std::isfinite(y) ? shortest(std::round(y * 1e6) / 1e6) : std::string("not computed");
  };
  out.error = worst;
  out.work = k;
  out.first_bad = watch.first_bad();
  out.bad_at_actuator = watch.bad_at_actuator();
  out.energy = std::max(energy[0].worst(), energy[1].worst());
  out.what = "spectral radius " + words(radius) +
             (largest > 1e5 ? ": grows 1e6 times in " + std::to_string(k) + " ticks, as it must" : "");
  return out;
}

Case loop_case(std::string family, std::string name, Expected expected, LoopPlan plan) {
  return {std::move(family), std::move(name), std::move(expected), [plan] { return run_loop(plan); }};
}

}  // namespace farhand::extreme
