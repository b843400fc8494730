// A scene run in virtual time, as its metrics.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

inline Metrics run(const std::string& scene, const std::vector<std::string>& sets) {
  const LoadedScene loaded = load_scene(scene, sets);
  return compute_metrics(simulate(loaded), loaded.scene);
}

// As a scene file takes it.
inline std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace farhand
