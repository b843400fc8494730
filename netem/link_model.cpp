#include "netem/link_model.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace farhand {
namespace {

// SplitMix64 (Steele, Lea & Flood 2014): spreads a seed over the state of the generator.
std::uint64_t split_mix(std::uint64_t& x) noexcept {
  std::uint64_t z = x += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

void check(bool good, const char* message) {
  if (!good) throw std::invalid_argument(message);
}

}  // namespace

LinkModel::LinkModel(const LinkModelParams& params, std::uint64_t seed, LinkDirection direction)
    : params_(params),
      delay_(from_seconds(params.delay_s)),
      cut_from_(from_seconds(params.cut_from_s)),
      cut_until_(from_seconds(params.cut_until_s)),
      certain_(params.loss == 0 && (params.jitter_s == 0 || params.distribution == DelayDistribution::kConstant)) {
  check(params.delay_s >= 0 && params.delay_s <= 3600, "delay_s must be in [0, 3600] s");
  check(params.jitter_s >= 0 && params.jitter_s <= 3600, "jitter_s must be in [0, 3600] s");
  check(!params.detour_delay_s || (*params.detour_delay_s >= 0 && *params.detour_delay_s <= 3600),
        "detour_delay_s must be in [0, 3600] s");
  check(params.loss >= 0 && params.loss <= 1, "loss must be in [0, 1]");
  // Hashed before the direction is mixed in: forward of one seed must not be backward of another.
  std::uint64_t x = split_mix(seed) + (direction == LinkDirection::kForward ? 0 : 0xD1B54A32D192ED03u);
  for (std::uint64_t& word : state_) word = split_mix(x);
}

// xoshiro256++ (Blackman & Vigna 2019). The standard library's distributions differ between implementations, so both
// the generator and the transforms are written out. In (0, 1).
double LinkModel::unit() noexcept {
  auto& s = state_;
  const std::uint64_t bits = std::rotl(s[0] + s[3], 23) + s[0];
  const std::uint64_t t = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= t;
  s[3] = std::rotl(s[3], 45);
  return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
}

double LinkModel::delay_s(Nanoseconds now) const noexcept {
  if (!params_.detour_delay_s) return params_.delay_s;
  const double t = to_seconds(now), ramp = std::max(params_.detour_ramp_s, 1e-9);
  const double there = std::clamp((t - params_.detour_from_s) / ramp, 0.0, 1.0),
               back = std::clamp((t - params_.detour_until_s) / ramp, 0.0, 1.0);
  return params_.delay_s + (there - back) * (*params_.detour_delay_s - params_.delay_s);
}

LinkModel::Fate LinkModel::offer(Nanoseconds now) noexcept {
  const bool cut = now >= cut_from_ && now < cut_until_;
  if (certain_) return {.lost = cut, .delay = params_.detour_delay_s ? from_seconds(delay_s(now)) : delay_};
  const double for_loss = unit(), a = unit(), b = unit();
  double deviation = 0.0;
  if (params_.distribution == DelayDistribution::kUniform) deviation = 2.0 * a - 1.0;
  if (params_.distribution == DelayDistribution::kNormal) {
    deviation = std::sqrt(-2.0 * std::log(a)) * std::cos(2.0 * std::numbers::pi * b);  // Box & Muller 1958
  }
  return {.lost = cut || for_loss < params_.loss,
          .delay = from_seconds(std::max(0.0, delay_s(now) + params_.jitter_s * deviation))};
}

}  // namespace farhand
