#include "common/advice/hammering.hpp"

#include <algorithm>
#include <cmath>

#include "common/plant/world.hpp"
#include "common/station/drive.hpp"

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

  // Without the limits, and all of the law from the first tick.
  DriveParams p;
  p.model = {.J_n = loop.J_n, .viscous = loop.viscous};
  p.K = {loop.K_p, loop.K_d, loop.K_f};
  p.g_dis = Cutoff::rad_s(loop.g_dis);
  p.g_reac = Cutoff::rad_s(loop.g_reac);
  p.g_v = Cutoff::rad_s(loop.g_v);
  p.gate = {.torque = 1e300, .torque_rate = 1e300, .velocity = 1e300, .range_min = -1e300, .range_max = 1e300};
  p.take_over_s = 1e-3 * loop.dt;
  p.dt_s = loop.dt;
  DirectDrive<1> drive(p);
  Motion<1> remote;
  double torque = 0;
  double early = 0, late = 0;  // fastest, rad/s
  std::uint64_t events = 0;
  for (double t = 0; t < kEnd; t += loop.dt) {
    world.advance(torque, t);
    const double speed = std::fabs(world.true_v());
    if (t >= kEarly && t < kEarly + kEnd - kLate) early = std::max(early, speed);
    if (t < kLate) events = world.counters().events;
    if (t >= kLate) late = std::max(late, speed);
    const Motion<1> local = drive.observe({Joints<1>(world.encoder())}, 1);
    remote.x[0] = t < kSent ? kBefore : kBehind;
    torque = drive.follow(local, remote, {}, 1).torque[0];
  }
  constexpr std::uint64_t kBounces = 5;
  constexpr double kRest = 1e-9;  // rad/s
  return late < std::max(0.5 * early, kRest) || world.counters().events < events + 2 * kBounces;
}

}  // namespace farhand
