// Whether the axis is the one that the scene describes: led to and fro by its own station, without a hand in the
// device, and judged by the torque that this takes (common/identify).
#pragma once

#include "common/identify/judgement.hpp"
#include "common/station/params.hpp"

namespace farhand {

// 40 kB: belongs to whoever makes the station, where the scene asks for it.
class Identifying {
 public:
  Identifying(const IdentifyingParams& params, const DriveParams& drive) noexcept
      : sweeps_(params.sweeps, drive.dt_s),
        fit_({.dt_s = drive.dt_s, .resolution = params.resolution}),
        said_(drive.model),
        lag_(kInTheWay + params.sweeps.acceleration / drive.K.K_p) {}

  void begin(double x) noexcept;

  // The motion to follow: the position alone counts.
  Motion<1> step(const Motion<1>& local, int ticks) noexcept;
  // x as read in this tick, and the torque that was then applied; ticks: periods since the last.
  void sample(double x, double torque, int ticks) noexcept;

  IdentifyingProgress progress() const noexcept { return progress_; }
  Misfit misfit() const noexcept { return misfit_; }  // once it is over

 private:
  // Behind the motion to follow, rad, besides the a/K_p by which a law without acceleration forward lags.
  static constexpr double kInTheWay = 0.1;

  Sweeps sweeps_;
  FreeMotion fit_;
  AxisModel said_;
  double lag_;
  Misfit misfit_ = Misfit::kTooLittleMotion;
  IdentifyingProgress progress_ = IdentifyingProgress::kUnderway;
};

}  // namespace farhand
