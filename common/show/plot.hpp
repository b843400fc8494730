// Pictures for reports: one SVG element each, without script or outside resource. Curves differ in colour, brightness
// and dash, so that they can be distinguished in grey and by colour-blind readers. Only finite numbers reach the SVG.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace farhand {

// How a curve is drawn. The first two are for the two sides throughout a report.
enum class Ink { kMaster, kSlave, kBlack, kMasterPale, kSlavePale, kGrey };

enum class Symbol { kCircle, kCross, kSquare };

struct PlotAxis {
  std::string label;                                       // with unit
  double from = std::numeric_limits<double>::quiet_NaN();  // not finite: from the data
  double until = std::numeric_limits<double>::quiet_NaN();
  bool log = false;  // values that are not positive are gaps
};

// Windows and events that several pictures over the same x axis share.
struct Landmarks {
  struct Window {
    double from, until;
    std::string label;
  };
  struct Event {
    double x;
    std::string label;  // short, written above the picture
    std::string text;   // shown by the browser on request
  };
  std::vector<Window> windows;
  std::vector<Event> events;
};

class Plot {
 public:
  Plot(std::string title, PlotAxis x, PlotAxis y, double width = 960, double height = 230);

  // x increasing; decimated per pixel column. A step of x by more than gap is a hole.
  void line(std::string label, std::vector<double> x, std::vector<double> y, Ink ink,
            double gap = std::numeric_limits<double>::infinity());
  void loop(std::string label, std::vector<double> x, std::vector<double> y, Ink ink);  // x may turn back
  void points(std::string label, std::vector<double> x, std::vector<double> y, Ink ink, Symbol symbol);
  void bars(std::string label, std::vector<double> edges, std::vector<double> heights, Ink ink, bool filled);
  void range(std::string label, std::vector<double> x, std::vector<double> y, Ink ink,
             bool filled);                            // least to greatest
  void rule(double y, std::string label);             // horizontal: a limit or an ideal
  void mark(double x, double y, std::string label);   // a ring around one place
  void right_axis(std::string label, double factor);  // y times factor, in another unit
  void landmarks(const Landmarks& landmarks) { landmarks_ = landmarks; }

  std::string svg() const;

 private:
  enum class Kind { kLine, kLoop, kPoints, kBars, kRange };
  struct Series {
    Kind kind;
    std::string label;
    std::vector<double> x, y;
    Ink ink;
    bool filled;
    Symbol symbol;
    double gap;
  };
  struct Rule {
    double y;
    std::string label;
  };
  struct Mark {
    double x, y;
    std::string label;
  };
  struct Scale;
  Scale x_scale() const;
  Scale y_scale() const;
  std::string legend() const;
  std::string drawn(const Series& series, const Scale& x, const Scale& y) const;

  std::string title_;
  PlotAxis x_, y_;
  double width_, height_;
  std::vector<Series> series_;
  std::vector<Rule> rules_;
  std::vector<Mark> marks_;
  std::string right_label_;
  double right_factor_ = 0;
  Landmarks landmarks_;
};

// Rows of coloured stretches over a shared x axis: states, limits, losses.
class Lanes {
 public:
  struct Stretch {
    double from, until;
    std::string fill;
    double height = 1;  // share of the lane, so that states differ in grey as well
    std::string label;  // written inside if there is room
  };
  Lanes(std::string title, PlotAxis x, double width = 960);
  void lane(std::string label, std::vector<Stretch> stretches);
  void landmarks(const Landmarks& landmarks) { landmarks_ = landmarks; }
  std::string svg() const;

 private:
  std::string title_;
  PlotAxis x_;
  double width_;
  std::vector<std::pair<std::string, std::vector<Stretch>>> lanes_;
  Landmarks landmarks_;
};

}  // namespace farhand
