#include "common/config/hammering.hpp"

#include <algorithm>
#include <cmath>

#include "common/control/four_channel.hpp"
#include "common/observer/rtob.hpp"
#include "common/plant/world.hpp"
#include "common/signal/derivative.hpp"

namespace farhand {

bool hits_die_out(const scene::Scene& scene, const Contact& wall) {
  constexpr double kFar = 1e3, kBehind = 0.01, kBefore = -0.2;      // rad; the wall is at 0
  constexpr double kSent = 0.5, kEarly = 2.5, kLate = 4, kEnd = 5;  // s
  const SideLoop loop = direct_slave_loop(scene, {});
  DirectSlaveWorld::Params params;
  params.motor = {
      .J = loop.axis.J, .viscous = loop.axis.b, .encoder_counts_per_rev = 0, .stop_min = -kFar, .stop_max = kFar};
  params.load.wall = Wall::Params{wall.k, wall.b, 0.0};
  DirectSlaveWorld world(params);

  Derivative<1> derivative(Cutoff::rad_s(loop.g_v), loop.dt);
  Dob<1> dob(loop.J_n, Cutoff::rad_s(loop.g_dis), loop.dt);
  Rtob<1> rtob({.J_n = loop.J_n, .viscous = loop.viscous}, Cutoff::rad_s(loop.g_reac), loop.dt);
  const FourChannelGains gains{loop.K_p, loop.K_d, loop.K_f};
  Motion<1> local, remote;
  Joints<1> tau = Joints<1>::Zero();
  double early = 0, late = 0;  // fastest, rad/s
  std::uint64_t events = 0;
  for (double t = 0; t < kEnd; t += loop.dt) {
    world.advance(tau[0], t);
    const double speed = std::fabs(world.true_v());
    if (t >= kEarly && t < kEarly + kEnd - kLate) early = std::max(early, speed);
    if (t < kLate) events = world.counters().events;
    if (t >= kLate) late = std::max(late, speed);
    local.x[0] = world.encoder();
    local.v = derivative.step(local.x);
    local.f = rtob.step(tau, local.x, local.v);
    remote.x[0] = t < kSent ? kBefore : kBehind;
    tau = loop.J_n * four_channel(gains, local, remote) + dob.step(tau, local.v);
  }
  constexpr std::uint64_t kBounces = 5;
  constexpr double kRest = 1e-9;  // rad/s
  return late < std::max(0.5 * early, kRest) || world.counters().events < events + 2 * kBounces;
}

}  // namespace farhand
