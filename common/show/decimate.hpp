// Fewer points, same picture: long curves are reduced to the resolution of a pixel, without losing a peak or closing a
// gap.
#pragma once

#include <vector>

namespace farhand {

inline constexpr std::size_t kMaxPoints = 2000;  // of one curve in a report

struct Polyline {
  std::vector<double> x, y;
};

// x must not decrease. Cuts [from, until] into columns and keeps the least and the greatest y of each, in the order in
// which they came. A new polyline starts after a value that is not finite, and where x jumps by more than gap.
std::vector<Polyline> decimate(const std::vector<double>& x, const std::vector<double>& y, double from, double until,
                               std::size_t columns, double gap);

// For curves that turn back, such as torque against angle: drops points that lie closer than a pixel to the last one
// kept, and more where kMaxPoints demands it. pixel_x and pixel_y are the size of a pixel in units of x and y.
std::vector<Polyline> thin_out(const std::vector<double>& x, const std::vector<double>& y, double pixel_x,
                               double pixel_y);

// Least and greatest y of each column, NaN where a column is empty.
struct Envelope {
  std::vector<double> x, least, greatest;  // x: middle of the column
};
Envelope envelope(const std::vector<double>& x, const std::vector<double>& y, double from, double until,
                  std::size_t columns);

}  // namespace farhand
