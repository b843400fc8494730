#include "common/identify/loop_friction.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace farhand {
namespace {

// Sorts the values.
double median(std::span<double> values) noexcept {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace

void LoopFrictionFit::add(std::size_t round, int direction, double x, double f) noexcept {
  const double place = (x - low_) / width_;
  if (!(place >= 0.0 && place < 1.0) || round >= kRounds) return;
  Sum& sum = sums_[round][static_cast<std::size_t>(place * kBins)][direction > 0 ? 0 : 1];
  sum.f += f;
  ++sum.count;
}

LoopFriction LoopFrictionFit::result(std::size_t rounds) const noexcept {
  std::array<double, kBins * kRounds> half{};
  std::size_t n = 0;
  double s_x = 0.0, s_y = 0.0, s_xx = 0.0, s_xy = 0.0;
  for (std::size_t round = 0; round < std::min(rounds, kRounds); ++round) {
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      const Sum &up = sums_[round][bin][0], &down = sums_[round][bin][1];
      if (up.count == 0 || down.count == 0) continue;
      const double there = up.f / up.count, back = down.f / down.count;
      half[n++] = 0.5 * (there - back);
      const double x = (static_cast<double>(bin) + 0.5) / kBins * width_, y = 0.5 * (there + back);
      s_x += x, s_y += y, s_xx += x * x, s_xy += x * y;
    }
  }
  LoopFriction found;
  if (n == 0) return found;
  const double all = static_cast<double>(n), moment = all * s_xx - s_x * s_x;
  found.values = static_cast<int>(n);
  found.slope = moment > 0.0 ? (all * s_xy - s_x * s_y) / moment : 0.0;
  const std::span<double> values(half.data(), n);
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  // A normal distribution has a standard deviation of 1.4826 median deviations.
  found.spread = 1.4826 * median(values);
  // Friction that the model compensates too much has a loop of the other sense. Its half width is a reaction, too.
  found.F_c = std::abs(middle);
  return found;
}

}  // namespace farhand
