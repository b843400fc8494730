// One direction of the scene's network as the link model takes it; for the program and for the simulator alike.
#pragma once

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
  return params;
}

}  // namespace farhand
