#include "common/identify/sweeps.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {

void Sweeps::begin(double x) noexcept {
  start_ = x;
  number_ = 0;
  t_ = 0.0;
}

// Spread evenly over 0..1 (golden ratio), the same in every run.
double Sweeps::scattered(int number) noexcept {
  const double turns = 0.6180339887498949 * number;
  return turns - std::floor(turns);
}

double Sweeps::turning_point(int number) const noexcept {
  if (number == 0 || number == 6 * params_.rounds) return params_.low;
  const double inside = kVary * scattered(number) * (params_.high - params_.low);
  return number % 2 == 1 ? params_.high - inside : params_.low + inside;
}

Sweeps::Way Sweeps::way(int number) const noexcept {
  const double slow = 0.25 * params_.speed;
  if (number == 0) return {start_, params_.low, slow};
  if (number == 6 * params_.rounds + 1) return {params_.low, start_, slow};
  if (number > 6 * params_.rounds) return {start_, start_, slow};  // comes to rest
  constexpr double kShare[] = {1.0, 0.5, 0.25};
  const double speed = kShare[(number - 1) / 2 % 3] * params_.speed * (1.0 - kVary * scattered(number));
  return {turning_point(number - 1), turning_point(number), speed};
}

double Sweeps::acceleration_time(const Way& way) const noexcept {
  return std::min(way.speed / params_.acceleration, std::sqrt(std::abs(way.to - way.from) / params_.acceleration));
}

double Sweeps::duration(const Way& way) const noexcept {
  const double length = std::abs(way.to - way.from), t_a = acceleration_time(way);
  return t_a > 0.0 ? t_a + length / (params_.acceleration * t_a) : 0.0;
}

Motion<1> Sweeps::step(int ticks) noexcept {
  t_ += ticks * dt_s_;
  while (!done() && t_ >= kRest + duration(way(number_))) {
    t_ -= kRest + duration(way(number_));
    ++number_;
  }
  Motion<1> m;
  if (done()) {
    m.x[0] = start_;
    return m;
  }
  const Way now = way(number_);
  const double sign = now.to > now.from ? 1.0 : -1.0, a = params_.acceleration;
  const double t_a = acceleration_time(now), all = duration(now), t = std::clamp(t_ - kRest, 0.0, all);
  const double begun = std::min(t, t_a), ends = std::min(all - t, t_a);
  if (t <= all - t_a) {
    m.x[0] = now.from + sign * a * begun * (0.5 * begun + (t - begun));
  } else {
    m.x[0] = now.to - sign * 0.5 * a * ends * ends;
  }
  m.v[0] = sign * a * std::min(begun, ends);
  return m;
}

double Sweeps::duration_s() const noexcept {
  double total = 0.0;
  for (int i = 1; i <= 6 * params_.rounds; ++i) total += kRest + duration(way(i));
  return total;
}

}  // namespace farhand
