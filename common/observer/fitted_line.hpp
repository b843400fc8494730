// The straight line closest to a slave's angles and torques, both of which have errors (Deming). Ordinary least squares
// would find a wall soft, because its angle is only noise. A sample is added for every step in angle or torque, so that
// rest neither adds samples nor makes older ones fade. Older samples have less weight.
#pragma once

#include <cmath>
#include <limits>

namespace farhand {

class FittedLine {
 public:
  static constexpr double kNoiseX = 1e-4, kNoiseF = 0.02;  // rad, N m: noise of the received angle and torque

  // memory: factor by which each new sample reduces the weight of all older ones, below 1.
  explicit FittedLine(double memory) : memory_(memory) {}

  void forget() noexcept {
    samples_ = sx_ = sf_ = sxx_ = sxf_ = sff_ = 0.0;
    last_x_ = last_f_ = std::numeric_limits<double>::infinity();
  }

  // x in rad, f in N m. False if the point is too close to the last sample, and is not added.
  bool add(double x, double f) noexcept {
    const double dx = (x - last_x_) / kStepX, df = (f - last_f_) / kStepF;
    if (dx * dx + df * df < 1) return false;
    last_x_ = x;
    last_f_ = f;
    samples_ = memory_ * samples_ + 1;
    sx_ = memory_ * sx_ + x;
    sf_ = memory_ * sf_ + f;
    sxx_ = memory_ * sxx_ + x * x;
    sxf_ = memory_ * sxf_ + x * f;
    sff_ = memory_ * sff_ + f * f;
    return true;
  }

  double samples() const noexcept { return samples_; }  // sum of the weights; the functions below need 1 at least
  double x() const noexcept { return sx_ / samples_; }  // means
  double f() const noexcept { return sf_ / samples_; }
  double xx() const noexcept { return sxx_ / samples_ - sx_ * sx_ / samples_ / samples_; }  // scatter
  double ff() const noexcept { return sff_ / samples_ - sf_ * sf_ / samples_ / samples_; }
  double xf() const noexcept { return sxf_ / samples_ - sx_ * sf_ / samples_ / samples_; }

  // True if the angles differ by more than noise.
  bool moved() const noexcept { return xx() > kStill * kNoiseX * kNoiseX; }
  // Slope in N m/rad; valid only if torque rises with the angle (xf() > 0).
  double slope() const noexcept {
    constexpr double kRatio = kNoiseF * kNoiseF / (kNoiseX * kNoiseX);
    const double u = ff() - kRatio * xx(), both = xf();
    return (u + std::sqrt(u * u + 4 * kRatio * both * both)) / (2 * both);
  }

 private:
  static constexpr double kStepX = 2e-3, kStepF = 0.04;  // rad, N m: distance between two samples
  static constexpr double kStill = 10.0;                 // times the square of the noise
  double memory_;
  double samples_ = 0.0, sx_ = 0.0, sf_ = 0.0, sxx_ = 0.0, sxf_ = 0.0, sff_ = 0.0;
  double last_x_ = std::numeric_limits<double>::infinity(), last_f_ = std::numeric_limits<double>::infinity();
};

}  // namespace farhand
