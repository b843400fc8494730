// Two layers (Franken et al. 2011): below the law that is to be transparent, a tank on each side holds the energy that
// the law may give to the person. The tanks feed each other through the network with a fixed share of their level per
// time; what a packet carries is the energy sent so far, so that a lost packet loses nothing. An empty tank gives
// nothing: the law's share of the motion fades over the last of its level. On the therapist's side a damper fills the
// tank as it falls below its level.
//
// So that no session begins with empty tanks, and no line between them, a station that drives nothing lends its tank
// the level and sends from it as if engaged. What therapist and patient together can be given beyond what they gave
// is these two levels and what was on its way.
#pragma once

#include <algorithm>

#include "common/law/params.hpp"

namespace farhand {

// All energies in joule.
class EnergyTank {
 public:
  // damping: of the damper at most, N m s/rad.
  EnergyTank(const TankParams& params, double damping, double dt_s)
      : params_(params), damping_(damping), share_sent_(params.rate * dt_s), level_(params.level) {}

  // Once per tick, of `ticks` periods. received: what the peer has sent so far, as known now.
  void lend(double received, int ticks) noexcept {
    received_ = received;
    sent_ += sending(ticks) * params_.level;
    level_ = params_.level;
  }
  // given: to the axis since the last tick; negative where it took.
  void step(double given, double received, int ticks) noexcept {
    level_ = std::min(level_ - given + std::max(0.0, received - received_), kFull * params_.level);
    received_ = received;
    const double leaves = sending(ticks) * std::max(0.0, level_);
    level_ -= leaves;
    sent_ += leaves;
  }

  double level() const noexcept { return level_; }
  double sent() const noexcept { return sent_; }
  // 1, and on the last of its level down to 0: of what the law asks for.
  double share() const noexcept { return std::clamp(level_ / (kLow * params_.level), 0.0, 1.0); }
  // N m s/rad, by which the tank is filled.
  double damping() const noexcept { return std::clamp(params_.alpha * (params_.level - level_), 0.0, damping_); }

 private:
  static constexpr double kLow = 0.2;    // of the level
  static constexpr double kFull = 20.0;  // levels
  double sending(int ticks) const noexcept { return std::min(1.0, share_sent_ * ticks); }

  TankParams params_;
  double damping_, share_sent_;
  double level_, sent_ = 0.0, received_ = 0.0;
};

}  // namespace farhand
