// Sessions whose metrics are known in closed form: both sides move as told, the network delays by two values.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "common/link/packet.hpp"
#include "common/record/session.hpp"
#include "proto/scene.pb.h"

namespace farhand {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kPi = std::numbers::pi;
inline constexpr double kTick = 1e-3;
inline constexpr int kEngaged = static_cast<int>(StationState::kEngaged);

struct Instant {
  double x = 0, v = 0, true_f = 0, f = 0;
};
using Course = std::function<Instant(double)>;

inline constexpr double kDuration = 20, kBase = 0.1, kDepth = 0.02;

inline scene::Scene windows(double free_from = 1, double free_until = 7, double contact_from = 10,
                            double contact_until = 20) {
  scene::Scene scene;
  scene.set_duration_s(kDuration);
  auto* w = scene.mutable_windows();
  w->mutable_free()->set_from_s(free_from);
  w->mutable_free()->set_until_s(free_until);
  w->mutable_contact()->set_from_s(contact_from);
  w->mutable_contact()->set_until_s(contact_until);
  w->set_degraded_tracking_rad(0.02);
  w->set_degraded_late(0.02);
  scene.mutable_slave()->mutable_hand()->set_rest_rad(0.05);
  return scene;
}

inline std::vector<StationSample> side(const Course& course, double from = 0, double until = kDuration) {
  std::vector<StationSample> out;
  for (int k = static_cast<int>(std::lround(from / kTick)); k * kTick <= until + 1e-9; ++k) {
    const double t = k * kTick;
    const Instant i = course(t);
    StationSample s;
    s.t_s = t;
    s.state = kEngaged;
    s.x_rad = s.true_x_rad = i.x;
    s.v_rad_s = s.true_v_rad_s = i.v;
    s.true_f_nm = i.true_f;
    s.f_nm = i.f;
    s.playout_delay_s = kDepth;
    s.rtt_s = 0.2;
    out.push_back(s);
  }
  return out;
}

// 100 ms each way for the fastest packet, half of the packets 10 ms later.
inline Session session_of(const Course& master, const Course& slave) {
  Session session;
  session.scene_name = "made_up";
  session.seed = 7;
  session.deterministic = true;
  session.master = side(master);
  session.slave = side(slave);
  for (int k = 0; k < 20000; ++k) {
    for (const bool forward : {true, false})
      session.link.push_back({k * kTick, forward, false, kBase, k % 2 == 0 ? kBase : kBase + 0.01});
  }
  session.master_counters.received = session.slave_counters.received = 1000;
  return session;
}

inline Course still(double x, double true_f, double f) {
  return [=](double) { return Instant{x, 0, true_f, f}; };
}

}  // namespace farhand
