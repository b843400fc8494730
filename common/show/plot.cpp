#include "common/show/plot.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "common/show/decimate.hpp"
#include "common/show/format.hpp"

namespace farhand {
namespace {

// The same for all, so that x axes line up below each other. Above the axes: title and legend, names of windows,
// numbers of events.
constexpr double kLeft = 76, kRight = 64, kTop = 48, kBottom = 40;
constexpr double kTitleLine = 12, kWindowLine = 30, kEventLine = 44;
constexpr double kUpperLegend = 26, kLowerLegend = 40;
constexpr double kLetter = 6.2, kTitleLetter = 7.6;  // mean width of a letter
constexpr double kLaneHeight = 22;

struct Look {
  const char* colour;
  const char* dash;
  double width;
};

Look look(Ink ink) {
  switch (ink) {
    case Ink::kMaster:
      return {"#08519c", "", 1.7};
    case Ink::kSlave:
      return {"#e6700b", "7 3", 1.7};
    case Ink::kBlack:
      return {"#111111", "", 1.5};
    case Ink::kMasterPale:
      return {"#6baed6", "2 2", 1.3};
    case Ink::kSlavePale:
      return {"#fdb863", "1 2.5", 1.6};
    case Ink::kGrey:
      return {"#8c8c8c", "", 0.9};
  }
  return {"#111111", "", 1.5};
}

// Pixels, a tenth is enough. Locale-free, unlike printf.
std::string px(double y) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, std::clamp(y, -1e6, 1e6), std::chars_format::fixed, 1);
  std::string out(buffer, end.ptr);
  if (out.size() > 2 && out.compare(out.size() - 2, 2, ".0") == 0) out.resize(out.size() - 2);
  return out == "-0" ? "0" : out;
}

std::string text(double x, double y, const std::string& anchor, const std::string& words,
                 const std::string& more = "") {
  return "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" + escaped(words) +
         "</text>\n";
}

std::string line_element(double x1, double y1, double x2, double y2, const std::string& look) {
  return "<line x1=\"" + px(x1) + "\" y1=\"" + px(y1) + "\" x2=\"" + px(x2) + "\" y2=\"" + px(y2) + "\" " + look +
         "/>\n";
}

std::string rectangle(double x, double y, double width, double height, const std::string& look) {
  return "<rect x=\"" + px(x) + "\" y=\"" + px(y) + "\" width=\"" + px(width) + "\" height=\"" + px(height) + "\" " +
         look + "/>\n";
}

std::string stroke(const Look& l) {
  std::string out = "fill=\"none\" stroke=\"" + std::string(l.colour) + "\" stroke-width=\"" + px(l.width) +
                    "\" stroke-linejoin=\"round\"";
  if (l.dash[0] != '\0') out += " stroke-dasharray=\"" + std::string(l.dash) + "\"";
  return out;
}

std::string opening(const std::string& title, double width, double height) {
  return "<svg width=\"" + px(width) + "\" height=\"" + px(height) + "\" viewBox=\"0 0 " + px(width) + " " +
         px(height) + "\" role=\"img\" aria-label=\"" + escaped(title) + "\">\n" +
         text(kLeft, kTitleLine, "start", title, " class=\"title\"");
}

}  // namespace

// Data to pixels along one axis.
struct Plot::Scale {
  double from = 0, until = 1, pixel_from = 0, pixel_until = 1;
  bool log = false;
  double at(double value) const {
    const double share = log ? std::log(value / from) / std::log(until / from) : (value - from) / (until - from);
    return pixel_from + share * (pixel_until - pixel_from);
  }
  bool shows(double value) const { return std::isfinite(value) && (!log || value > 0); }
  double per_pixel() const { return (until - from) / std::abs(pixel_until - pixel_from); }
};

namespace {

// From the axis, else from the data with a margin; never empty.
template <class Scale>
void fit(Scale& scale, const PlotAxis& axis, double least, double greatest) {
  scale.log = axis.log;
  if (!(least <= greatest)) least = axis.log ? 1 : 0, greatest = axis.log ? 10 : 1;
  if (axis.log) {
    scale.from = std::isfinite(axis.from) ? axis.from : least / 1.2;
    scale.until = std::isfinite(axis.until) ? axis.until : greatest * 1.2;
    return;
  }
  const double spread = greatest - least;
  const double margin = spread > 1e-9 * std::max(std::abs(least), std::abs(greatest))
                            ? 0.06 * spread
                            : std::max(0.1 * std::abs(least), 1e-6);
  scale.from = std::isfinite(axis.from) ? axis.from : least - margin;
  scale.until = std::isfinite(axis.until) ? axis.until : greatest + margin;
  if (!(scale.until > scale.from)) scale.until = scale.from + 1;
}

template <class Scale>
std::string x_axis(const Scale& x, const PlotAxis& axis, double top, double bottom) {
  std::string out;
  const std::vector<double> at =
      ticks(x.from, x.until, static_cast<int>(std::abs(x.pixel_until - x.pixel_from) / 80), axis.log);
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double p = x.at(at[k]), step = at.size() > 1 ? at[1] - at[0] : 1;
    out += line_element(p, top, p, bottom, "class=\"grid\"");
    out += text(p, bottom + 14, "middle", axis.log ? decade_label(at[k]) : tick_label(at[k], step));
  }
  return out + text((x.pixel_from + x.pixel_until) / 2, bottom + 31, "middle", axis.label, " class=\"label\"");
}

template <class Scale>
std::string windows_below(const Landmarks& landmarks, const Scale& x, double top, double bottom) {
  std::string out;
  for (const auto& window : landmarks.windows) {
    const double a = std::clamp(window.from, x.from, x.until), b = std::clamp(window.until, x.from, x.until);
    if (!(b > a)) continue;
    out += rectangle(x.at(a), top, x.at(b) - x.at(a), bottom - top, "class=\"window\"");
    out += text((x.at(a) + x.at(b)) / 2, kWindowLine, "middle", window.label, " class=\"windowname\"");
  }
  return out;
}

template <class Scale>
std::string events_above(const Landmarks& landmarks, const Scale& x, double top, double bottom) {
  std::string out;
  double free_from = -1e9;  // a label must not cover the one before it
  for (const auto& event : landmarks.events) {
    if (!(event.x >= x.from && event.x <= x.until)) continue;
    const double p = x.at(event.x);
    out += "<g><title>" + escaped(event.text) + "</title>" + line_element(p, top - 2, p, bottom, "class=\"event\"");
    const double half = 0.5 * kLetter * static_cast<double>(event.label.size()) + 1;
    if (p - half >= free_from) {
      out += text(p, kEventLine, "middle", event.label, " class=\"eventname\"");
      free_from = p + half;
    }
    out += "</g>\n";
  }
  return out;
}

std::string path(const std::vector<Polyline>& lines, const std::string& look, auto to_pixels) {
  std::string d;
  for (const Polyline& line : lines) {
    for (std::size_t k = 0; k < line.x.size(); ++k) {
      const auto [p, q] = to_pixels(line.x[k], line.y[k]);
      d += (k == 0 ? "M" : k == 1 ? "L" : " ") + px(p) + " " + px(q);
    }
    if (line.x.size() == 1) d += "h.1";  // a lone value is a dot
  }
  return d.empty() ? "" : "<path " + look + " d=\"" + d + "\"/>\n";
}

std::string symbol_element(Symbol symbol, double p, double q, const Look& l) {
  const std::string edge = "stroke=\"" + std::string(l.colour) + "\" stroke-width=\"1.4\" fill=\"none\"";
  switch (symbol) {
    case Symbol::kCircle:
      return "<circle cx=\"" + px(p) + "\" cy=\"" + px(q) + "\" r=\"3.5\" " + edge + "/>\n";
    case Symbol::kSquare:
      return rectangle(p - 3, q - 3, 6, 6, edge);
    case Symbol::kCross:
      return "<path " + edge + " d=\"M" + px(p - 3.5) + " " + px(q - 3.5) + "l7 7m-7 0l7 -7\"/>\n";
  }
  return "";
}

}  // namespace

Plot::Plot(std::string title, PlotAxis x, PlotAxis y, double width, double height)
    : title_(std::move(title)), x_(std::move(x)), y_(std::move(y)), width_(width), height_(height) {}

void Plot::line(std::string label, std::vector<double> x, std::vector<double> y, Ink ink, double gap) {
  series_.push_back({Kind::kLine, std::move(label), std::move(x), std::move(y), ink, false, Symbol::kCircle, gap});
}
void Plot::loop(std::string label, std::vector<double> x, std::vector<double> y, Ink ink) {
  series_.push_back({Kind::kLoop, std::move(label), std::move(x), std::move(y), ink, false, Symbol::kCircle, 0});
}
void Plot::points(std::string label, std::vector<double> x, std::vector<double> y, Ink ink, Symbol symbol) {
  series_.push_back({Kind::kPoints, std::move(label), std::move(x), std::move(y), ink, false, symbol, 0});
}
void Plot::bars(std::string label, std::vector<double> edges, std::vector<double> heights, Ink ink, bool filled) {
  series_.push_back(
      {Kind::kBars, std::move(label), std::move(edges), std::move(heights), ink, filled, Symbol::kSquare, 0});
}
void Plot::range(std::string label, std::vector<double> x, std::vector<double> y, Ink ink, bool filled) {
  series_.push_back({Kind::kRange, std::move(label), std::move(x), std::move(y), ink, filled, Symbol::kSquare, 0});
}
void Plot::rule(double y, std::string label) {
  if (std::isfinite(y)) rules_.push_back({y, std::move(label)});
}
void Plot::mark(double x, double y, std::string label) { marks_.push_back({x, y, std::move(label)}); }
void Plot::right_axis(std::string label, double factor) {
  right_label_ = std::move(label);
  right_factor_ = factor;
}

Plot::Scale Plot::x_scale() const {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const Series& s : series_) {
    for (const double x : s.x) {
      if (std::isfinite(x) && (!x_.log || x > 0)) least = std::min(least, x), greatest = std::max(greatest, x);
    }
  }
  Scale scale;
  fit(scale, x_, least, greatest);
  scale.pixel_from = kLeft;
  scale.pixel_until = width_ - kRight;
  return scale;
}

Plot::Scale Plot::y_scale() const {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  const auto add = [&](double y) {
    if (std::isfinite(y) && (!y_.log || y > 0)) least = std::min(least, y), greatest = std::max(greatest, y);
  };
  for (const Series& s : series_) {
    if (s.kind == Kind::kBars && !y_.log) add(0);
    for (const double y : s.y) add(y);
  }
  for (const Rule& r : rules_) add(r.y);
  Scale scale;
  fit(scale, y_, least, greatest);
  scale.pixel_from = height_ - kBottom;
  scale.pixel_until = kTop;
  return scale;
}

std::string Plot::drawn(const Series& s, const Scale& x, const Scale& y) const {
  const auto pixels = [&](double a, double b) { return std::pair(x.at(a), y.at(b)); };
  const Look ink = look(s.ink);
  if (s.kind == Kind::kPoints) {
    std::string out;
    for (std::size_t k = 0; k < std::min({s.x.size(), s.y.size(), kMaxPoints}); ++k) {
      if (x.shows(s.x[k]) && y.shows(s.y[k])) out += symbol_element(s.symbol, x.at(s.x[k]), y.at(s.y[k]), ink);
    }
    return out;
  }
  if (s.kind == Kind::kBars) {
    std::string out;
    Polyline outline;
    const double floor = y.log ? y.from : std::max(0.0, y.from);
    for (std::size_t k = 0; k + 1 < s.x.size() && k < s.y.size(); ++k) {
      if (!x.shows(s.x[k]) || !x.shows(s.x[k + 1])) continue;
      const double height = y.shows(s.y[k]) ? std::max(s.y[k], floor) : floor;
      for (const double edge : {s.x[k], s.x[k + 1]}) {
        outline.x.push_back(edge);
        outline.y.push_back(height);
      }
      if (!s.filled || height <= floor) continue;
      out += rectangle(x.at(s.x[k]), y.at(height), x.at(s.x[k + 1]) - x.at(s.x[k]), y.at(floor) - y.at(height),
                       "fill=\"" + std::string(ink.colour) + "\" fill-opacity=\".45\"");
    }
    return s.filled ? out : path({outline}, stroke(ink), pixels);
  }
  if (s.kind == Kind::kRange) {
    const Envelope e = envelope(s.x, s.y, x.from, x.until, 240);
    std::string out;
    for (std::size_t k = 0; s.filled && k < e.x.size(); ++k) {
      if (!y.shows(e.least[k])) continue;
      const double width = (x.pixel_until - x.pixel_from) / 240;
      const double top = y.at(e.greatest[k]), height = std::max(2.0, y.at(e.least[k]) - top);
      out += rectangle(x.at(e.x[k]) - width / 2, top, width + 0.1, height,
                       "fill=\"" + std::string(ink.colour) + "\" fill-opacity=\".35\"");
    }
    if (!s.filled) {
      for (const auto* edge : {&e.least, &e.greatest})
        out += path(decimate(e.x, *edge, x.from, x.until, 240, s.gap > 0 ? s.gap : 1e300), stroke(ink), pixels);
    }
    return out;
  }
  // On a log axis what is not positive becomes a gap, and columns are cut in the logarithm.
  std::vector<double> a = s.x, b = s.y;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
    if (!x.shows(a[k]) || !y.shows(b[k])) b[k] = std::numeric_limits<double>::quiet_NaN();
  }
  if (s.kind == Kind::kLoop || x.log) {
    for (std::size_t k = 0; k < a.size(); ++k) {
      const auto [p, q] = x.shows(a[k]) && y.shows(b[k]) ? pixels(a[k], b[k]) : std::pair(b[k], b[k]);
      a[k] = p, b[k] = q;
    }
    return path(thin_out(a, b, 1, 1), stroke(ink), [](double p, double q) { return std::pair(p, q); });
  }
  const auto columns =
      static_cast<std::size_t>(std::min(x.pixel_until - x.pixel_from, static_cast<double>(kMaxPoints / 2)));
  return path(decimate(a, b, x.from, x.until, columns, s.gap), stroke(ink), pixels);
}

std::string Plot::svg() const {
  const Scale x = x_scale(), y = y_scale();
  std::string out = opening(title_, width_, height_) + windows_below(landmarks_, x, kTop, height_ - kBottom);
  out += x_axis(x, x_, kTop, height_ - kBottom);
  const int wanted = static_cast<int>((height_ - kTop - kBottom) / 28);
  const std::vector<double> left = ticks(y.from, y.until, wanted, y_.log);
  for (const double tick : left) {
    out += line_element(kLeft, y.at(tick), width_ - kRight, y.at(tick), "class=\"grid\"");
    out += text(kLeft - 6, y.at(tick) + 4, "end",
                y_.log ? decade_label(tick) : tick_label(tick, left.size() > 1 ? left[1] - left[0] : 1));
  }
  const double middle = (kTop + height_ - kBottom) / 2;
  out += text(0, 0, "middle", y_.label, " class=\"label\" transform=\"translate(14 " + px(middle) + ") rotate(-90)\"");
  if (right_factor_ != 0) {
    const std::vector<double> right = ticks(right_factor_ * y.from, right_factor_ * y.until, wanted, false);
    for (const double tick : right) {
      const double q = y.at(tick / right_factor_);
      out += line_element(width_ - kRight, q, width_ - kRight + 4, q, "class=\"axis\"");
      out += text(width_ - kRight + 7, q + 4, "start", tick_label(tick, right.size() > 1 ? right[1] - right[0] : 1));
    }
    out += text(0, 0, "middle", right_label_,
                " class=\"label\" transform=\"translate(" + px(width_ - 8) + " " + px(middle) + ") rotate(-90)\"");
  }
  // The inner svg cuts what leaves the axes; its view box keeps the coordinates of the outer one.
  const std::string box =
      px(kLeft) + " " + px(kTop) + " " + px(width_ - kLeft - kRight) + " " + px(height_ - kTop - kBottom);
  out += "<svg x=\"" + px(kLeft) + "\" y=\"" + px(kTop) + "\" width=\"" + px(width_ - kLeft - kRight) + "\" height=\"" +
         px(height_ - kTop - kBottom) + "\" viewBox=\"" + box + "\">\n";
  for (const Series& s : series_) out += drawn(s, x, y);
  for (const Rule& r : rules_) {
    if (!y.shows(r.y)) continue;
    out += line_element(kLeft, y.at(r.y), width_ - kRight, y.at(r.y), "class=\"rule\"");
    out +=
        text(width_ - kRight - 4, y.at(r.y) + (y.at(r.y) < kTop + 16 ? 12 : -4), "end", r.label, " class=\"rulename\"");
  }
  for (const Mark& m : marks_) {
    if (!x.shows(m.x) || !y.shows(m.y)) continue;
    const double p = x.at(m.x), q = y.at(m.y);
    const bool left_half = p < (kLeft + width_ - kRight) / 2;
    out += "<circle cx=\"" + px(p) + "\" cy=\"" + px(q) + "\" r=\"8\" class=\"mark\"/>\n";
    // Beside the ring and above it, so that a bar through its middle does not strike the name out.
    out += text(p + (left_half ? 9 : -9), q + (q < kTop + 20 ? 18 : -8), left_half ? "start" : "end", m.label,
                " class=\"rulename\"");
  }
  out += "</svg>\n" + events_above(landmarks_, x, kTop, height_ - kBottom);
  out += rectangle(kLeft, kTop, width_ - kLeft - kRight, height_ - kTop - kBottom, "class=\"frame\"");
  return out + legend() + "</svg>\n";
}

// Above the axes and not within them, where it would cover data: beside the title, or below it if there is no room, in
// two lines if it must.
std::string Plot::legend() const {
  constexpr double kSample = 26, kToText = 4, kBetween = 14;
  const auto width_of = [](const Series& s) {
    return kSample + kToText + kBetween + kLetter * static_cast<double>(s.label.size());
  };
  double width = 0;
  for (const Series& s : series_) {
    if (!s.label.empty()) width += width_of(s);
  }
  const bool beside = kTitleLetter * static_cast<double>(title_.size()) + width < width_ - kLeft - kRight;
  constexpr double kMargin = 2;
  const bool one_line = kMargin + width - kBetween <= width_;
  double line = beside ? kTitleLine : one_line ? kWindowLine : kUpperLegend;
  double left = std::max(kMargin, width_ - kRight - width + kBetween);
  std::string out;
  for (const Series& s : series_) {
    if (s.label.empty()) continue;
    if (left + width_of(s) - kBetween > width_ && line == kUpperLegend) line = kLowerLegend, left = kMargin;
    const double middle = line - 4;
    const Look ink = look(s.ink);
    const bool solid = s.filled && (s.kind == Kind::kBars || s.kind == Kind::kRange);
    if (s.kind == Kind::kPoints) {
      out += symbol_element(s.symbol, left + kSample / 2, middle, ink);
    } else if (solid) {
      out += rectangle(left, middle - 5, kSample, 10, "fill=\"" + std::string(ink.colour) + "\" fill-opacity=\".5\"");
    } else {
      out += line_element(left, middle, left + kSample, middle, stroke(ink));
    }
    out += text(left + kSample + kToText, line, "start", s.label);
    left += width_of(s);
  }
  return out;
}

Lanes::Lanes(std::string title, PlotAxis x, double width) : title_(std::move(title)), x_(std::move(x)), width_(width) {}

void Lanes::lane(std::string label, std::vector<Stretch> stretches) {
  lanes_.emplace_back(std::move(label), std::move(stretches));
}

std::string Lanes::svg() const {
  struct {
    double from, until, pixel_from, pixel_until;
    double at(double v) const { return pixel_from + (v - from) / (until - from) * (pixel_until - pixel_from); }
  } const x{x_.from, x_.until > x_.from ? x_.until : x_.from + 1, kLeft, width_ - kRight};
  const double bottom = kTop + kLaneHeight * static_cast<double>(lanes_.size());
  std::string out = opening(title_, width_, bottom + kBottom) + windows_below(landmarks_, x, kTop, bottom) +
                    x_axis(x, x_, kTop, bottom);
  double top = kTop;
  for (const auto& [label, stretches] : lanes_) {
    out += text(kLeft - 6, top + kLaneHeight / 2 + 4, "end", label);
    double drawn_until = -1e9;  // stretches within the pixel that is already painted add nothing
    std::string drawn_fill;
    for (const Stretch& stretch : stretches) {
      const double a = std::clamp(stretch.from, x.from, x.until), b = std::clamp(stretch.until, x.from, x.until);
      if (!(b >= a) || stretch.from > x.until || stretch.until < x.from) continue;
      const double p = x.at(a), width = std::max(1.0, x.at(b) - p);
      if (stretch.fill == drawn_fill && p + width <= drawn_until + 0.5) continue;
      drawn_until = p + width;
      drawn_fill = stretch.fill;
      const double height = (kLaneHeight - 4) * stretch.height;
      out += rectangle(p, top + kLaneHeight - 2 - height, width, height, "fill=\"" + stretch.fill + "\"");
      const bool room = width > kLetter * static_cast<double>(stretch.label.size()) + 8 && stretch.height > 0.6;
      if (room) out += text(p + 5, top + kLaneHeight / 2 + 4, "start", stretch.label, " class=\"lanename\"");
    }
    top += kLaneHeight;
    out += line_element(kLeft, top, width_ - kRight, top, "class=\"grid\"");
  }
  out += rectangle(kLeft, kTop, width_ - kLeft - kRight, bottom - kTop, "class=\"frame\"");
  return out + events_above(landmarks_, x, kTop, bottom) + "</svg>\n";
}

}  // namespace farhand
