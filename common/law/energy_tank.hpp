// Two layers (Franken et al. 2011). Below the law, which is made for transparency, a tank on each side holds the energy
// that the law may give to the person. Each tank sends a fixed share of its energy per time to the other tank through
// the network. A packet carries the sum of the energy sent so far, so that a lost packet loses no energy. An empty tank
// gives no energy: over the last fifth of the desired level the law's share of the motion fades to 0. On the
// therapist's side a damper refills the tank when it is below the desired level.
//
// Tanks start full. While it is not engaged, a station fills its own tank to the desired level and transmits from it as
// it would when engaged. Therefore therapist and patient together can receive at most two desired levels, and the
// energy that was in transit, more than they gave.
#pragma once

#include <algorithm>

#include "common/law/params.hpp"

namespace farhand {

// All energies in joule.
class EnergyTank {
 public:
  // damping: largest damping of the damper, N m s/rad.
  EnergyTank(const TankParams& params, double damping, double dt_s)
      : params_(params), damping_(damping), share_sent_(params.rate * dt_s), level_(params.level) {}

  // While not engaged, once per tick of `ticks` periods. received: energy that the peer has sent so far, J.
  void lend(double received, int ticks) noexcept {
    received_ = received;
    sent_ += sending(ticks) * params_.level;
    level_ = params_.level;
  }
  // While engaged. given: energy given to the axis since the last tick, J; negative if the axis gave energy.
  void step(double given, double received, int ticks) noexcept {
    level_ = std::min(level_ - given + std::max(0.0, received - received_), kFull * params_.level);
    received_ = received;
    const double leaves = sending(ticks) * std::max(0.0, level_);
    level_ -= leaves;
    sent_ += leaves;
  }

  double level() const noexcept { return level_; }
  double sent() const noexcept { return sent_; }
  // The share of the law that the tank allows: 1, and on the last kLow of the desired level down to 0.
  double share() const noexcept { return std::clamp(level_ / (kLow * params_.level), 0.0, 1.0); }
  // Damping that fills the tank, N m s/rad.
  double damping() const noexcept { return std::clamp(params_.alpha * (params_.level - level_), 0.0, damping_); }

 private:
  static constexpr double kLow = 0.2;    // of the desired level
  static constexpr double kFull = 20.0;  // largest energy, in desired levels
  double sending(int ticks) const noexcept { return std::min(1.0, share_sent_ * ticks); }

  TankParams params_;
  double damping_, share_sent_;
  double level_, sent_ = 0.0, received_ = 0.0;
};

}  // namespace farhand
