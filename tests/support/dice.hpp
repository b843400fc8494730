// What a scene can be asked to do: settings, movements and mishaps, drawn from a seed.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>

#include "common/signal/limit_bits.hpp"
#include "common/signal/motion.hpp"
#include "common/station/params.hpp"

namespace farhand {

using J1 = Joints<1>;
constexpr int kEpisodes = 200, kTicks = 500;  // 100,000 ticks of each scene

// Settings, movements and mishaps for one scene, the same for every seed.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}

  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(random_() >> 11) * 0x1p-53); }
  bool once_in(std::uint64_t n) { return random_() % n == 0; }

  ControlParams settings() {
    ControlParams p;
    p.drive.stiffest_nm_per_rad = 1e9;  // what the dice throw is no motion: it may stand at any speed
    p.drive.model = {.J_n = uniform(1e-3, 6e-3),
                     .K_tn = 0.15,
                     .viscous = uniform(0, 0.01),
                     .coulomb = uniform(0, 0.05),
                     .gravity = uniform(0, 0.5),
                     .gravity_angle = uniform(-2, 2)};
    p.drive.K = {.K_p = uniform(50, 900), .K_d = uniform(5, 60), .K_f = uniform(50, 250)};
    p.drive.g_dis = p.drive.g_reac = Cutoff::rad_s(uniform(50, 1000));
    p.drive.g_v = Cutoff::rad_s(uniform(100, 1000));
    p.drive.gate = {.torque = uniform(0.3, 4),
                    .torque_rate = uniform(50, 4000),
                    .velocity = uniform(0.5, 5),
                    .range_min = uniform(-0.4, -0.2),
                    .range_max = uniform(0.2, 0.4)};
    p.drive.take_over_s = uniform(0.05, 0.5);
    p.law.g_net = Cutoff::rad_s(uniform(100, 2000));
    p.law.local_model = once_in(2) ? LocalModel::kWithForce : LocalModel::kThesis;
    p.law.sdcv = {.f_1 = uniform(0.05, 0.3), .f_2 = uniform(0.4, 1), .alpha_cutoff = Cutoff::rad_s(uniform(1, 50))};
    return p;
  }

  // Walks through the range and beyond it, as an encoder sees it, and now and then jumps.
  double walk(double& position, double& speed) {
    speed = 0.99 * speed + uniform(-0.05, 0.05);
    position += 1e-3 * speed;
    if (once_in(400)) position = uniform(-0.45, 0.45);
    const double count = 2 * std::numbers::pi / 20000;
    return std::round(position / count) * count;
  }

  double not_a_number() {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    return once_in(3) ? std::numeric_limits<double>::quiet_NaN() : (once_in(2) ? kInf : -kInf);
  }

  // x, x_r, v_r, f_r of the next tick. True if one of them is no number.
  bool next(double (&in)[4]) {
    in[0] = walk(x_, v_);
    in[1] = walk(x_r_, v_r_);
    in[2] = once_in(100) ? uniform(-8, 8) : v_r_;
    f_r_ = 0.995 * f_r_ + uniform(-0.05, 0.05);
    in[3] = once_in(50) ? uniform(-40, 40) : f_r_;
    if (!once_in(200)) return false;
    in[random_() % 4] = not_a_number();
    return true;
  }

 private:
  std::mt19937_64 random_;
  double x_ = 0, v_ = 0, x_r_ = 0, v_r_ = 0, f_r_ = 0;
};

// How often each limit acted: a comparison that never saw one proves nothing about it.
class Seen {
 public:
  void add(std::uint32_t limits) {
    for (std::uint32_t bit = 1; bit <= kAllLimits; bit <<= 1) count_[bit] += (limits & bit) != 0;
  }
  int of(LimitBit bit) const { return count_.at(bit); }

 private:
  std::map<std::uint32_t, int> count_;
};

inline Motion<1> motion(double x, double v, double f) { return {J1(x), J1(v), J1(f)}; }

}  // namespace farhand
