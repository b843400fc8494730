// Checks whether the axis is the one that the scene describes. Its own station leads it to and fro, without a hand in
// the device, and the torque that this needs is evaluated (common/identify).
#pragma once

#include "common/identify/judgement.hpp"
#include "common/station/params.hpp"

namespace farhand {

// It takes 40 kB. The maker of the station owns it, and makes one only if the scene asks for it.
class Identifying {
 public:
  Identifying(const IdentifyingParams& params, const DriveParams& drive) noexcept
      : sweeps_(params.sweeps, drive.dt_s),
        fit_({.dt_s = drive.dt_s, .resolution = params.resolution}),
        said_(drive.model),
        lag_(kInTheWay + params.sweeps.acceleration / drive.K.K_p) {}

  void begin(double x) noexcept;

  // The motion to follow; only the position acts.
  Motion<1> step(const Motion<1>& local, int ticks) noexcept;
  // x: angle read in this tick, rad; torque: torque applied in this tick, N m; ticks: periods since the last call.
  void sample(double x, double torque, int ticks) noexcept;

  IdentifyingProgress progress() const noexcept { return progress_; }
  Misfit misfit() const noexcept { return misfit_; }  // once it is over

 private:
  // Largest lag behind the motion to follow, rad, beyond the a/K_p by which a law without acceleration feed-forward
  // lags.
  static constexpr double kInTheWay = 0.1;

  Sweeps sweeps_;
  FreeMotion fit_;
  AxisModel said_;
  double lag_;
  Misfit misfit_ = Misfit::kTooLittleMotion;
  IdentifyingProgress progress_ = IdentifyingProgress::kUnderway;
};

}  // namespace farhand
