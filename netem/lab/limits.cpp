#include "netem/lab/limits.hpp"

#include <algorithm>
#include <cmath>

#include "common/analysis/bisect.hpp"
#include "netem/lab/simulated_limits.hpp"

namespace farhand {
namespace {

constexpr double kLow = 0.01, kHigh = 20.0;          // g dt
constexpr double kLowRatio = 0.1, kHighRatio = 4.0;  // J_n/J
constexpr double kJ = 4e-3, kDt = 1e-3;

double spaced(double low, double high, int i, int count) { return low * std::pow(high / low, double(i) / (count - 1)); }

SideLoop at(const LimitMap& map, double g_dt, double ratio) {
  SideLoop loop = map.base;
  (map.of_rtob ? loop.g_reac : loop.g_dis) = g_dt / loop.dt;
  loop.J_n = ratio * loop.axis.J;
  return loop;
}

// Where the radius passes 1 along g dt, from below or above.
std::vector<double> crossings(const LimitMap& map, double ratio) {
  constexpr int kSteps = 160;
  const auto excess = [&](double g_dt) { return spectral_radius(at(map, g_dt, ratio)) - 1.0; };
  std::vector<double> found;
  double before = kLow, sign = excess(kLow);
  for (int i = 1; i < kSteps; ++i) {
    const double now = spaced(kLow, kHigh, i, kSteps), then = excess(now);
    if ((sign < 0) != (then < 0)) {
      double a = before, b = now;
      for (int k = 0; k < 40; ++k) {
        const double middle = std::sqrt(a * b);
        ((excess(middle) < 0) == (sign < 0) ? a : b) = middle;
      }
      found.push_back(a);
    }
    before = now, sign = then;
  }
  return found;
}

void fill(LimitMap& map) {
  constexpr int kColumns = 34, kRows = 25, kFine = 121;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const double g_dt = spaced(kLow, kHigh, column, kColumns), ratio = spaced(kLowRatio, kHighRatio, row, kRows);
      map.points.push_back({g_dt, ratio, spectral_radius(at(map, g_dt, ratio))});
    }
  constexpr std::size_t kBranches = 3;
  std::vector<MapPoint> branches[kBranches];
  for (int i = 0; i < kFine; ++i) {
    const double ratio = spaced(kLowRatio, kHighRatio, i, kFine);
    const std::vector<double> found = crossings(map, ratio);
    for (std::size_t branch = 0; branch < kBranches; ++branch)
      branches[branch].push_back(branch < found.size() ? MapPoint{found[branch], ratio, 1.0} : MapPoint{});
    constexpr int kEvery = 5;
    if (i % kEvery != 0 || found.empty() || spectral_radius(at(map, kLow, ratio)) >= 1.0) continue;
    const auto rests = [&](double g_dt) { return comes_to_rest(at(map, g_dt, ratio)); };
    map.simulated.push_back({ratio, found[0], simulated_limit(found[0], rests, 9)});
  }
  for (const auto& branch : branches) {
    constexpr double kLeap = 1.6;  // from one ratio to the next: another branch took this place
    for (std::size_t i = 0; i < branch.size(); ++i) {
      if (i > 0 && std::abs(std::log(branch[i].g_dt / branch[i - 1].g_dt)) > std::log(kLeap))
        map.boundary.push_back({});
      map.boundary.push_back(branch[i]);
    }
    map.boundary.push_back({});
  }
}

}  // namespace

std::vector<LimitMap> limit_maps() {
  const SideLoop alone{.axis = {kJ, 0.0, 0.0}, .dt = kDt};
  SideLoop position = alone;
  position.axis.b = position.viscous = 0.002;
  position.K_p = 400.0, position.K_d = 40.0;
  SideLoop whole = position;
  whole.K_f = 1.0 / kJ;
  const auto touching = [&](double k, double b) {
    SideLoop loop = whole;
    loop.axis.k = k, loop.axis.b += b;
    return loop;
  };
  SideLoop viscous = alone;
  viscous.axis.b = 0.5;

  std::vector<LimitMap> maps{
      {"dob_free", "DOB alone, free rotor without friction", false, alone, {}, {}, {}, {}},
      {"dob_viscous", "DOB alone, free rotor with 0.5 N m s/rad", false, viscous, {}, {}, {}, {}},
      {"dob_position", "DOB and position loop (K_p 400, K_d 40), free rotor", false, position, {}, {}, {}, {}},
      {"dob_wall", "DOB in the whole law (K_f 1/J), wall of 1000 N m/rad", false, touching(1e3, 0.4), {}, {}, {}, {}},
      {"rtob_free", "RTOB in the whole law (K_f 1/J), free rotor", true, whole, {}, {}, {}, {}},
      {"rtob_hand", "RTOB in the whole law (K_f 1/J), hand of 5 N m/rad", true, touching(5, 0.02), {}, {}, {}, {}},
      {"rtob_wall", "RTOB in the whole law (K_f 1/J), wall of 1000 N m/rad", true, touching(1e3, 0.4), {}, {}, {}, {}},
  };
  for (LimitMap& map : maps) fill(map);
  for (int i = 0; i < 60; ++i) {
    const double ratio = spaced(2.1, kHighRatio, i, 60);
    maps[0].closed_form.push_back({dob_limit(ratio), ratio, 1.0});
  }
  return maps;
}

std::vector<WallLimits> wall_limits() {
  std::vector<WallLimits> all;
  for (const double b : {0.02, 0.05})
    for (int i = 0; i <= 12; ++i) {
      const SampledWall wall{kJ, b, kDt, b * i / 12.5};
      WallLimits limits{wall, stability_limit(wall), passivity_limit(wall), 0, 0};
      limits.simulated_stability = simulated_limit(
          limits.stability, [&](double K) { return dies_out(wall, K); }, 10);
      limits.simulated_passivity = simulated_limit(
          limits.passivity, [&](double K) { return least_energy(wall, K, Between::kStraight) > 0; }, 10);
      all.push_back(limits);
    }
  return all;
}

}  // namespace farhand
