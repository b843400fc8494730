// The straight line that lies closest to what a slave told of angle and torque, where both err (Deming): least squares
// would take a wall for soft, whose angle is but noise. A sample for every step in angle or torque, so that rest
// teaches nothing and wears nothing out; older samples weigh less.
#pragma once

#include <cmath>
#include <limits>

namespace farhand {

class FittedLine {
 public:
  static constexpr double kNoiseX = 1e-4, kNoiseF = 0.02;  // rad, N m: of what is told

  // memory: weight of a sample at the next, below 1.
  explicit FittedLine(double memory) : memory_(memory) {}

  void forget() noexcept {
    samples_ = sx_ = sf_ = sxx_ = sxf_ = sff_ = 0.0;
    last_x_ = last_f_ = std::numeric_limits<double>::infinity();
  }

  // rad, N m. False where this is too close to the sample before to be one.
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

  double samples() const noexcept { return samples_; }  // by weight; what follows needs one at least
  double x() const noexcept { return sx_ / samples_; }  // means
  double f() const noexcept { return sf_ / samples_; }
  double xx() const noexcept { return sxx_ / samples_ - sx_ * sx_ / samples_ / samples_; }  // scatter
  double ff() const noexcept { return sff_ / samples_ - sf_ * sf_ / samples_ / samples_; }
  double xf() const noexcept { return sxf_ / samples_ - sx_ * sf_ / samples_ / samples_; }

  // The angle has moved by more than noise.
  bool moved() const noexcept { return xx() > kStill * kNoiseX * kNoiseX; }
  // N m/rad; only where torque rises with the angle.
  double slope() const noexcept {
    constexpr double kRatio = kNoiseF * kNoiseF / (kNoiseX * kNoiseX);
    const double u = ff() - kRatio * xx(), both = xf();
    return (u + std::sqrt(u * u + 4 * kRatio * both * both)) / (2 * both);
  }

 private:
  static constexpr double kStepX = 2e-3, kStepF = 0.04;  // rad, N m: from sample to sample
  static constexpr double kStill = 10.0;                 // squares of the noise
  double memory_;
  double samples_ = 0.0, sx_ = 0.0, sf_ = 0.0, sxx_ = 0.0, sxf_ = 0.0, sff_ = 0.0;
  double last_x_ = std::numeric_limits<double>::infinity(), last_f_ = std::numeric_limits<double>::infinity();
};

}  // namespace farhand
