// Maps of the stability of observers and force loop over g dt and J_n/J, and of the limits of a sampled wall. They are
// computed from the roots of the loop and, along a few lines, found by running the blocks themselves.
#pragma once

#include <string>
#include <vector>

#include "common/analysis/sampled_wall.hpp"
#include "common/analysis/side_loop.hpp"

namespace farhand {

struct MapPoint {
  double g_dt = 0, ratio = 0;  // ratio: J_n/J
  double radius = 0;           // spectral radius: unstable from 1
};

struct LimitMap {
  std::string key, title;
  bool of_rtob = false;  // which cut-off runs along g dt
  SideLoop base;
  std::vector<MapPoint> points;
  std::vector<MapPoint> boundary;     // crossings, one branch after the other, a radius of 0 between them
  std::vector<MapPoint> closed_form;  // where there is one
  struct Simulated {
    double ratio, computed, simulated;  // g dt
  };
  std::vector<Simulated> simulated;  // the first crossing of each ratio that has one
};

std::vector<LimitMap> limit_maps();

struct WallLimits {
  SampledWall wall;
  double stability, passivity, simulated_stability, simulated_passivity;
};

// J 4e-3, T 1 ms, with B from 0 to b.
std::vector<WallLimits> wall_limits();

}  // namespace farhand
