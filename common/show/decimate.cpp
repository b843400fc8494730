#include "common/show/decimate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/record/session.hpp"

namespace farhand {
namespace {

std::size_t column_of(double x, double from, double until, std::size_t columns) {
  const double place = (x - from) / (until - from) * static_cast<double>(columns);
  return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(columns) - 1));
}

// Extremes of the part of one polyline that falls into one column.
struct Extremes {
  std::size_t least = 0, greatest = 0;
  bool empty = true;
  void add(const std::vector<double>& y, std::size_t k) {
    if (empty || y[k] < y[least]) least = k;
    if (empty || y[k] > y[greatest]) greatest = k;
    empty = false;
  }
};

}  // namespace

std::vector<Polyline> decimate(const std::vector<double>& x, const std::vector<double>& y, double from, double until,
                               std::size_t columns, double gap) {
  std::vector<Polyline> out;
  if (!(until > from) || columns == 0) return out;
  Extremes extremes;
  std::size_t column = 0;
  bool open = false;  // the last polyline may be continued
  double last_x = kAbsent;
  const auto flush = [&] {
    if (extremes.empty) return;
    if (!open) out.emplace_back();
    open = true;
    const auto [first, second] = std::minmax(extremes.least, extremes.greatest);
    out.back().x.push_back(x[first]);
    out.back().y.push_back(y[first]);
    if (second != first) {
      out.back().x.push_back(x[second]);
      out.back().y.push_back(y[second]);
    }
    extremes = Extremes();
  };
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k]) || x[k] < from || x[k] > until) continue;
    const std::size_t here = column_of(x[k], from, until, columns);
    // A gap within a column cannot be seen, and would let a broken signal exceed the number of points.
    const bool gap_here = !std::isfinite(y[k]) || x[k] - last_x > gap;
    if (here != column) flush();
    if (gap_here && extremes.empty) open = false;
    if (gap_here && here != column) open = false;
    column = here;
    last_x = x[k];
    if (std::isfinite(y[k])) extremes.add(y, k);
  }
  flush();
  return out;
}

std::vector<Polyline> thin_out(const std::vector<double>& x, const std::vector<double>& y, double pixel_x,
                               double pixel_y) {
  std::vector<Polyline> out;
  const auto keep = [&](double reach, std::size_t stride) {
    out.clear();
    std::size_t points = 0, candidates = 0;
    bool open = false;
    for (std::size_t k = 0; k < x.size(); ++k) {
      if (!std::isfinite(x[k]) || !std::isfinite(y[k])) {
        open = false;
        continue;
      }
      if (open) {
        const Polyline& line = out.back();
        if (std::hypot((x[k] - line.x.back()) / pixel_x, (y[k] - line.y.back()) / pixel_y) < reach) continue;
      }
      if (candidates++ % stride != 0) continue;
      if (!open) out.emplace_back();
      open = true;
      out.back().x.push_back(x[k]);
      out.back().y.push_back(y[k]);
      ++points;
    }
    return points;
  };
  std::size_t points = 0;
  for (const double reach : {1.0, 2.0, 4.0}) {
    points = keep(reach, 1);
    if (points <= kMaxPoints) return out;
  }
  // Coarser steps would cut corners that are seen; what is left is noise, of which every so many points tell the same.
  for (std::size_t stride = 2; points > kMaxPoints; stride *= 2) points = keep(4.0, stride);
  return out;
}

Envelope envelope(const std::vector<double>& x, const std::vector<double>& y, double from, double until,
                  std::size_t columns) {
  Envelope out;
  for (std::size_t k = 0; k < columns; ++k) {
    out.x.push_back(from + (static_cast<double>(k) + 0.5) * (until - from) / static_cast<double>(columns));
    out.least.push_back(kAbsent);
    out.greatest.push_back(kAbsent);
  }
  for (std::size_t k = 0; k < x.size() && columns > 0 && until > from; ++k) {
    if (!std::isfinite(y[k]) || !(x[k] >= from && x[k] <= until)) continue;
    const std::size_t c = column_of(x[k], from, until, columns);
    out.least[c] = std::fmin(out.least[c], y[k]);
    out.greatest[c] = std::fmax(out.greatest[c], y[k]);
  }
  return out;
}

}  // namespace farhand
