#include "netem/lab/limits_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <ostream>

#include "common/judge/digits.hpp"
#include "common/show/plot.hpp"
#include "common/show/report.hpp"

namespace farhand {
namespace {

constexpr double kSlow = 0.99;  // radius: takes longer than 100 ticks to fall by e

double off(double simulated, double computed) { return 100.0 * (simulated / computed - 1.0); }

template <class Keep>
void add_points(Plot& plot, const std::string& label, const LimitMap& map, Ink ink, Symbol symbol, const Keep& keep) {
  std::vector<double> x, y;
  for (const MapPoint& point : map.points)
    if (keep(point.radius)) x.push_back(point.g_dt), y.push_back(point.ratio);
  if (!x.empty()) plot.points(label, x, y, ink, symbol);
}

void add_line(Plot& plot, const std::string& label, const std::vector<MapPoint>& points, Ink ink) {
  std::vector<double> x, y;
  for (const MapPoint& point : points) {
    const bool there = point.radius > 0.0 && std::isfinite(point.g_dt);
    x.push_back(there ? point.g_dt : std::nan("")), y.push_back(there ? point.ratio : std::nan(""));
  }
  if (std::any_of(x.begin(), x.end(), [](double u) { return std::isfinite(u); })) plot.loop(label, x, y, ink);
}

std::string picture(const LimitMap& map) {
  Plot plot(map.title, {map.of_rtob ? "g_reac dt" : "g_dis dt", 0.009, 22.0, true}, {"J_n / J", 0.09, 4.4, true}, 960,
            420);
  add_points(plot, "stable", map, Ink::kMaster, Symbol::kCircle, [](double r) { return r < kSlow; });
  add_points(plot, "stable, slowly", map, Ink::kMasterPale, Symbol::kCircle,
             [](double r) { return r >= kSlow && r < 1.0; });
  add_points(plot, "unstable", map, Ink::kSlave, Symbol::kCross, [](double r) { return r >= 1.0; });
  add_line(plot, "roots at 1", map.boundary, Ink::kBlack);
  if (!map.closed_form.empty()) add_line(plot, "2 (1 + g dt)/(g dt)", map.closed_form, Ink::kSlavePale);
  std::vector<double> x, y;
  for (const LimitMap::Simulated& s : map.simulated) x.push_back(s.simulated), y.push_back(s.ratio);
  if (!x.empty()) plot.points("limit of the blocks", x, y, Ink::kBlack, Symbol::kSquare);
  return plot.svg();
}

std::string picture(const std::vector<WallLimits>& walls, double b) {
  Plot plot("Sampled wall: J 0.004 kg m2, b " + three_digits(b) + " N m s/rad, T 1 ms", {"B (N m s/rad)"},
            {"K (N m/rad)", 0.0}, 960, 300);
  std::vector<double> x, stability, passivity, stable, passive;
  for (const WallLimits& w : walls) {
    if (w.wall.b != b) continue;
    x.push_back(w.wall.B);
    stability.push_back(w.stability), passivity.push_back(w.passivity);
    stable.push_back(w.simulated_stability), passive.push_back(w.simulated_passivity);
  }
  plot.line("stable below", x, stability, Ink::kMaster);
  plot.points("device comes to rest below", x, stable, Ink::kMaster, Symbol::kCircle);
  plot.line("passive below", x, passivity, Ink::kSlave);
  plot.points("no energy to draw below", x, passive, Ink::kSlave, Symbol::kCross);
  return plot.svg();
}

double worst(const LimitMap& map) {
  double most = 0.0;
  for (const LimitMap::Simulated& s : map.simulated) most = std::max(most, std::abs(off(s.simulated, s.computed)));
  return most;
}

}  // namespace

void print_limits(const std::vector<LimitMap>& maps, const std::vector<WallLimits>& walls, std::ostream& out) {
  out << "Largest g dt that is stable, from the roots of the loop and from running the blocks\n";
  for (const LimitMap& map : maps) {
    const auto unstable =
        std::count_if(map.points.begin(), map.points.end(), [](const auto& p) { return p.radius >= 1; });
    out << "\n"
        << map.key << ": " << map.title << "; " << unstable << " of " << map.points.size() << " points unstable\n";
    if (map.simulated.empty()) continue;
    out << "  " << std::setw(8) << "J_n/J" << std::setw(14) << (map.of_rtob ? "g_reac dt" : "g_dis dt") << std::setw(12)
        << "blocks" << std::setw(10) << "off, %" << '\n';
    for (const LimitMap::Simulated& s : map.simulated)
      out << "  " << std::setw(8) << three_digits(s.ratio) << std::setw(14) << three_digits(s.computed) << std::setw(12)
          << three_digits(s.simulated) << std::setw(10) << three_digits(off(s.simulated, s.computed)) << '\n';
  }
  out << "\nSampled wall: largest K, N m/rad (J 0.004 kg m2, T 1 ms)\n  " << std::setw(8) << "b" << std::setw(10) << "B"
      << std::setw(12) << "stable" << std::setw(12) << "simulated" << std::setw(12) << "passive" << std::setw(12)
      << "simulated" << '\n';
  for (const WallLimits& w : walls)
    out << "  " << std::setw(8) << three_digits(w.wall.b) << std::setw(10) << three_digits(w.wall.B) << std::setw(12)
        << three_digits(w.stability) << std::setw(12) << three_digits(w.simulated_stability) << std::setw(12)
        << three_digits(w.passivity) << std::setw(12) << three_digits(w.simulated_passivity) << '\n';
}

void write_limits_csv(const std::vector<LimitMap>& maps, std::ostream& out) {
  out << "map,g_dt,inertia_ratio,spectral_radius,stable\n" << std::setprecision(9);
  for (const LimitMap& map : maps)
    for (const MapPoint& point : map.points)
      out << map.key << ',' << point.g_dt << ',' << point.ratio << ',' << point.radius << ','
          << (point.radius < 1.0 ? 1 : 0) << '\n';
}

std::string limits_html(const std::vector<LimitMap>& maps, const std::vector<WallLimits>& walls) {
  std::string out =
      "<h1>Limits of stability</h1>\n<p class=\"under\">base set: J 0.004 kg m2, tick 1 ms, g_dis = g_reac = 200 rad/s "
      "where they are not varied, g_v 500 rad/s</p>\n<p>Every symbol is one computed loop. Squares are limits that "
      "were "
      "found by running derivative, DOB, RTOB and law of the station on an axis that moves exactly.</p>\n";
  out += "<h2>Observers</h2>\n";
  for (const LimitMap& map : maps) {
    out += picture(map);
    out += "<p class=\"note\">" +
           (map.simulated.empty() ? std::string("No limit within the map.")
                                  : "Blocks and roots differ by at most " + three_digits(worst(map)) + " % in g dt.") +
           "</p>\n";
  }
  out +=
      "<h2>Sampled wall</h2>\n<p>Lines: exact zero-order-hold eigenvalues; b = K T/2 + |B|. Symbols: simulated.</p>\n";
  for (const double b : {0.02, 0.05}) out += picture(walls, b);
  return html_page("farhand: limits of stability", out);
}

}  // namespace farhand
