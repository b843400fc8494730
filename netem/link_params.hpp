// Parameters of the link model for one direction of the scene's network, for the program and for the simulator.
#pragma once

#include <algorithm>

#include "netem/link_model.hpp"
#include "proto/scene.pb.h"

namespace farhand {

inline LinkModelParams link_params(const scene::Path& path) {
  LinkModelParams params;
  params.delay_s = path.delay_s();
  params.jitter_s = path.jitter_s();
  params.distribution = path.distribution() == scene::NORMAL_DISTRIBUTION ? DelayDistribution::kNormal
                        : path.distribution() == scene::UNIFORM           ? DelayDistribution::kUniform
                                                                          : DelayDistribution::kConstant;
  params.loss = path.loss();
  params.cut_from_s = path.cut_from_s();
  params.cut_until_s = path.cut_until_s();
  if (path.has_detour_delay_s()) params.detour_delay_s = path.detour_delay_s();
  params.detour_from_s = path.detour_from_s();
  params.detour_until_s = path.detour_until_s();
  params.detour_ramp_s = path.detour_ramp_s();
  return params;
}

// Number of datagrams, one per tick, that can be on their way in this direction; a normal delay beyond ten deviations
// does not occur.
inline std::size_t datagrams_on_way(const scene::Path& path, double tick_s) {
  const double longest = std::max(path.delay_s(), path.has_detour_delay_s() ? path.detour_delay_s() : 0.0);
  return static_cast<std::size_t>((longest + 10.0 * path.jitter_s()) / tick_s) + 16;
}

}  // namespace farhand
