// The maps that farhand-lab prints: every simulated limit beside its computed one, and the pictures of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "netem/lab/limits_report.hpp"

namespace farhand {
namespace {

TEST(Limits, MapsAgreeWithTheBlocksAndThePictureShowsEveryPoint) {
  const std::vector<LimitMap> maps = limit_maps();
  const std::vector<WallLimits> walls = wall_limits();
  std::size_t compared = 0, points = 0;
  for (const LimitMap& map : maps) {
    for (const LimitMap::Simulated& s : map.simulated)
      EXPECT_NEAR(s.simulated, s.computed, 0.02 * s.computed) << map.key << ' ' << s.ratio;
    compared += map.simulated.size();
    points += map.points.size();
  }
  EXPECT_GE(compared, 30u);
  for (const MapPoint& point : maps[0].closed_form)
    EXPECT_NEAR(point.ratio, 2 * (1 + point.g_dt) / point.g_dt, 1e-9 * point.ratio);
  for (const WallLimits& w : walls) {
    EXPECT_NEAR(w.simulated_stability, w.stability, 0.01 * w.stability) << w.wall.b << ' ' << w.wall.B;
    EXPECT_NEAR(w.simulated_passivity, w.passivity, 0.01 * w.passivity) << w.wall.b << ' ' << w.wall.B;
  }

  const std::string html = limits_html(maps, walls);
  const auto count = [&](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = html.find(part); at != std::string::npos; at = html.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_GE(count("<circle") + count("l7 7m-7 0l7 -7"), points);  // and those of the legends
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_EQ(html.find("inf"), std::string::npos);

  std::ostringstream csv;
  write_limits_csv(maps, csv);
  const std::string text = csv.str();
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), points + 1);
}

}  // namespace
}  // namespace farhand
