// Fate of a datagram on its way: lost or delayed, drawn from a seed, in virtual time. One model per direction.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/signal/joints.hpp"

namespace farhand {

enum class DelayDistribution : std::uint8_t {
  kConstant,
  kUniform,  // delay_s +- jitter_s
  kNormal,   // mean delay_s, standard deviation jitter_s
};

struct LinkModelParams {
  double delay_s = 0.0;
  double jitter_s = 0.0;
  DelayDistribution distribution = DelayDistribution::kUniform;
  double loss = 0.0;        // probability
  double cut_from_s = 1e9;  // everything sent in [from, until) is lost
  double cut_until_s = 1e9;
  std::optional<double> detour_delay_s = std::nullopt;  // to which delay_s goes, within detour_ramp_s, and back
  double detour_from_s = 1e9;
  double detour_until_s = 1e9;
  double detour_ramp_s = 2.0;
};

enum class LinkDirection : std::uint8_t { kForward, kBackward };

class LinkModel {
 public:
  struct Fate {
    bool lost;
    Nanoseconds delay;  // never negative; drawn also for a lost one
  };

  // Throws std::invalid_argument for values that no link can have.
  LinkModel(const LinkModelParams& params, std::uint64_t seed, LinkDirection direction);

  // `now` counts from the start of the link. Each call takes the same number of random draws, so that a change of loss,
  // jitter or cut does not change the delays of other datagrams. A link without chance draws none.
  Fate offer(Nanoseconds now) noexcept;

 private:
  double unit() noexcept;
  double delay_s(Nanoseconds now) const noexcept;  // without jitter

  LinkModelParams params_;
  Nanoseconds delay_;
  Nanoseconds cut_from_;
  Nanoseconds cut_until_;
  bool certain_;  // nothing is left to chance
  std::array<std::uint64_t, 4> state_;
};

}  // namespace farhand
