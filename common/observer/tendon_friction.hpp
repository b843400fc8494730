// Estimates friction that a torque sensor cannot distinguish from the hand, because it acts behind the sensor: tendons,
// gears. The estimate uses a property of friction alone. In unloaded motion the reaction depends only on the distance
// moved since the last reversal, and not on speed or angle:
//
//   f = F_c z,   dz/dx = (1 - z sign(dx)) / L          (Dahl 1968; z runs from -1 to 1 over a distance of the order L)
//
// Therefore f is compared with z for several L, over the distance moved. If one L explains nearly all of f, F_c is the
// friction. If none does, the axis is loaded, and the last estimate stays. A hand's own friction is not distinguished
// from that of the device.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace farhand {

// z of one axis.
class Hysteresis {
 public:
  void step(double x, double L) noexcept {
    const double dx = x - x_;
    x_ = x;
    const double along = dx < 0 ? -1.0 : 1.0;
    z_ = along + (z_ - along) * std::exp(-std::abs(dx) / L);
  }
  void reset(double x) noexcept { x_ = x, z_ = 0.0; }
  double value() const noexcept { return z_; }

 private:
  double x_ = 0.0, z_ = 0.0;
};

class TendonFriction {
 public:
  // x, f: angle and reaction, rad, N m.
  void step(double x, double f) noexcept {
    if (!begun_) {
      begun_ = true;
      x_ = x;
      for (Turn& turn : turns_) turn.z.reset(x);
      return;
    }
    // x passes through a play, so that toggling by one count is no reversal.
    const double play = std::clamp(x - x_, -kPlay, kPlay), dx = x - x_ - play;
    if (dx == 0.0) return;
    x_ += dx;
    const double way = std::abs(dx), keep = std::exp(-way / kMemory);
    ff_ = keep * ff_ + way * f * f;
    way_ = keep * way_ + way;
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      Turn& t = turns_[i];
      t.z.step(x_, kLengths[i]);
      const double z = t.z.value();
      t.zz = keep * t.zz + way * z * z;
      t.zf = keep * t.zf + way * z * f;
      t.z_mean = keep * t.z_mean + way * z;
    }
    gone_ += way;
    if (gone_ < kEnough) return;
    const auto explained = [](const Turn& t) { return t.zz > 0.0 ? t.zf * std::abs(t.zf) / t.zz : 0.0; };
    std::size_t best = 0;
    for (std::size_t i = 1; i < turns_.size(); ++i) {
      if (explained(turns_[i]) > explained(turns_[best])) best = i;
    }
    const double most = explained(turns_[best]);
    if (ff_ - most > std::max(kRest * most, kNoise * kNoise * way_)) return;
    if (std::abs(turns_[best].z_mean) > kBothWays * way_) return;
    const double F_c = turns_[best].zf / turns_[best].zz;
    F_c_ = F_c > kLeast ? F_c : 0.0;
    found_ = true;
    L_ = kLengths[best];
  }

  // Moves on without learning from f.
  void go_on(double x) noexcept {
    if (!begun_) return;
    x_ = x;
    for (std::size_t i = 0; i < turns_.size(); ++i) turns_[i].z.step(x_, kLengths[i]);
  }

  double F_c() const noexcept { return F_c_; }    // N m; 0 while none was found
  bool found() const noexcept { return found_; }  // F_c is known, also where it is 0
  double L() const noexcept { return L_; }        // rad

 private:
  static constexpr double kPlay = 0.4e-3;   // rad, more than a count of 20000
  static constexpr double kMemory = 1.0;    // rad of way
  static constexpr double kEnough = 0.5;    // rad of way
  static constexpr double kRest = 0.05;     // largest unexplained share of the square of f
  static constexpr double kNoise = 0.03;    // N m, of f
  static constexpr double kBothWays = 0.5;  // bound on |mean z|: in one direction a pressed spring looks like friction
  static constexpr double kLeast = 0.015;   // N m: observers, and a soft hand with some damping, leave less
  static constexpr std::array<double, 6> kLengths{2.5e-3, 4e-3, 7e-3, 12e-3, 21e-3, 36e-3};  // rad
  struct Turn {
    Hysteresis z;
    double zz = 0.0, zf = 0.0, z_mean = 0.0;
  };
  std::array<Turn, kLengths.size()> turns_;
  double x_ = 0.0, ff_ = 0.0, way_ = 0.0, gone_ = 0.0;
  double F_c_ = 0.0, L_ = kLengths[0];
  bool begun_ = false, found_ = false;
};

}  // namespace farhand
