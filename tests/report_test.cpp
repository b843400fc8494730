// The report as a file: well-formed, self-contained, bounded, and honest about what is missing. FARHAND_REPORT=PATH
// keeps the page of the made-up session for looking at.
#include "common/show/report.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <locale>
#include <numbers>
#include <sstream>

#include "common/judge/digits.hpp"
#include "common/link/packet.hpp"
#include "common/show/decimate.hpp"
#include "common/show/figures.hpp"
#include "common/show/format.hpp"
#include "common/show/plot.hpp"
#include "tests/support/well_formed.hpp"

namespace farhand {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = std::numbers::pi;

scene::Scene made_up_scene() {
  scene::Scene scene;
  scene.set_description("20 s over 100 ms \u00b120 ms each way with 1 % loss: free motion, contact, release");
  scene.set_duration_s(20);
  scene.mutable_windows()->mutable_free()->set_from_s(4);
  scene.mutable_windows()->mutable_free()->set_until_s(10);
  scene.mutable_windows()->mutable_contact()->set_from_s(12.5);
  scene.mutable_windows()->mutable_contact()->set_until_s(17.5);
  scene.mutable_windows()->set_degraded_tracking_rad(0.02);
  scene.mutable_windows()->set_degraded_late(0.02);
  scene.mutable_slave()->mutable_hand()->set_rest_rad(0);
  return scene;
}

double minimum_jerk(double u) { return u <= 0 ? 0 : u >= 1 ? 1 : u * u * u * (10 - 15 * u + 6 * u * u); }

double intended(double t) {
  if (t < 2) return 0;
  if (t < 10) return 0.25 * std::sin(kPi * (t - 2));
  return 0.3 * (minimum_jerk(t - 11.5) - minimum_jerk(t - 17.5));
}

// Looks like a session of the demo: free motion, contact with a spring of 5 N m/rad, release; 100 ms +-20 ms with 1 %
// loss, a hole in the recording, a hold after a burst of losses, a limit.
Session made_up_session() {
  Session session;
  session.scene_name = "demo";
  session.scene_text = "description: \"<b>demo</b> & 'more'\"\narchitecture: FOUR_CHANNEL_CDOB_SDCV\nduration_s: 20\n";
  session.seed = 7;
  session.deterministic = true;
  session.clock_offset_bound_s = 0.0004;
  std::uint64_t random = 88172645463325252u;
  const auto uniform = [&] {  // -1..1, xorshift
    random ^= random << 13, random ^= random >> 7, random ^= random << 17;
    return static_cast<double>(random >> 11) / 4503599627370496.0 - 1.0;
  };
  const double T_p = 0.12;
  const auto hand = [](double t, double x) { return t < 11 ? 0.02 * std::sin(4 * t) : 5 * x; };
  for (int k = 0; k <= 20000; ++k) {
    const double t = k * 1e-3;
    const double blend = minimum_jerk((t - 0.9) / 0.5);
    StationSample m, s;
    m.t_s = s.t_s = t;
    const bool hold = t > 10.6 && t < 10.75;
    m.state = t < 0.5 ? 0 : t < 0.9 ? 1 : 2;
    s.state = t < 0.6 ? 0 : t < 1.0 ? 1 : hold ? 3 : 2;
    m.true_x_rad = 0.94 * intended(t);
    s.true_x_rad = 0.94 * intended(t - T_p) + 0.0015 * std::sin(9 * t) * blend;
    m.true_v_rad_s = 940 * (intended(t) - intended(t - 1e-3));
    s.true_v_rad_s = 940 * (intended(t - T_p) - intended(t - T_p - 1e-3));
    s.true_f_nm = blend * hand(t, s.true_x_rad);
    m.true_f_nm = -blend * (0.97 * hand(t, 0.94 * intended(t - 2 * T_p)) + 0.003 * m.true_v_rad_s);
    for (StationSample* a : {&m, &s}) {
      a->x_rad = a->true_x_rad + 1.6e-4 * uniform();
      a->v_rad_s = a->true_v_rad_s + 0.02 * uniform();
      a->f_nm = a->true_f_nm + 0.02 * uniform();
      a->command_nm = a->true_f_nm;
      a->playout_delay_s = 0.04 * minimum_jerk(t / 2);
    }
    m.rtt_s = t < 0.25 ? 0 : 0.2 + 0.02 * uniform();
    m.x_cdob_rad = 0.25 * blend * (intended(t) - intended(t - 0.24));
    m.alpha = 1 - minimum_jerk(t - 12) + minimum_jerk(t - 17.6);
    if (t > 12.2 && t < 12.45) m.limits |= kLimitRate;
    if (t > 13.0 && t < 13.2) s.limits |= kLimitTorque;
    if (!(t > 7.0 && t < 7.3)) session.master.push_back(m);
    session.slave.push_back(s);
    for (const bool forward : {true, false}) {
      LinkSample p;
      p.t_s = t;
      p.forward = forward;
      p.asked_delay_s = 0.1 + 0.02 * uniform();
      p.achieved_delay_s = p.asked_delay_s + 0.0005 * (uniform() + 1);
      p.lost = uniform() > 0.98 || (forward && t > 10.5 && t < 10.64);
      session.link.push_back(p);
    }
  }
  session.events = {{0.5, "master", "operator: engage"},
                    {0.9, "master", "engaged"},
                    {1.0, "slave", "engaged"},
                    {10.6, "slave", "holding: nothing received for 100 ms <peer lost?>"},
                    {10.75, "slave", "engaged"}};
  session.master_counters.ticks = session.slave_counters.ticks = 20001;
  session.master_counters.received = 19800;
  session.slave_counters.received = 19650;
  session.slave_counters.late = 41;
  session.slave_counters.reordered = 9000;
  return session;
}

std::size_t points_of(const std::string& d) {
  return static_cast<std::size_t>(std::count(d.begin(), d.end(), 'M') + std::count(d.begin(), d.end(), 'L')) +
         static_cast<std::size_t>(std::count(d.begin(), d.end(), ' ')) / 2;
}

std::size_t most_points(const std::string& html) {
  std::size_t most = 0;
  for (std::size_t k = html.find(" d=\""); k != std::string::npos; k = html.find(" d=\"", k + 1)) {
    most = std::max(most, points_of(html.substr(k + 4, html.find('"', k + 4) - k - 4)));
  }
  return most;
}

void expect_sound(const std::string& html) {
  EXPECT_TRUE(well_formed(html));
  std::string lower = html;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto* banned :
       {"<script", "http", "url(", "@import", "src=", "href=", ">nan", "\"nan", " nan", "\"inf\"", ">inf<", ">-nan"}) {
    EXPECT_EQ(lower.find(banned), std::string::npos) << banned << ": " << html.substr(lower.find(banned), 80);
  }
  // "nan" may occur in a word of a scene, never in a picture.
  for (std::size_t k = lower.find("<svg"); k != std::string::npos; k = lower.find("<svg", k + 1)) {
    const std::string svg = lower.substr(k, lower.find("</svg>", k) - k);
    for (const auto* banned : {"nan", "inf"}) EXPECT_EQ(svg.find(banned), std::string::npos);
  }
  EXPECT_LE(most_points(html), 2 * kMaxPoints);  // a path may hold the two edges of a range
}

TEST(Report, OfARealisticSessionIsWellFormedSelfContainedAndBounded) {
  const Session session = made_up_session();
  const scene::Scene scene = made_up_scene();
  const std::string html = report_html(session, scene, compute_metrics(session, scene));
  if (const char* path = std::getenv("FARHAND_REPORT")) std::ofstream(path) << html;
  expect_sound(html);
  EXPECT_LT(html.size(), 1'500'000u);
  for (const auto* part : {"Session degraded", "Network", "Receiver", "Laws", "Motion", "Torque", "Limits", "Events",
                           "All metrics", "Counters", "seed 7", "x_cdob", "alpha", "RMS of the last 1 s", "peak so far",
                           "Torque against angle", "Lost packets", "farhand-lab run"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  for (const MetricInfo& info : kMetrics) {
    if (info.key == "reasons" || info.key == "absent") continue;
    EXPECT_NE(html.find("<code>" + std::string(info.key) + "</code>"), std::string::npos) << info.key;
  }
}

TEST(Report, EscapesEveryTextThatComesFromOutside) {
  Session session = made_up_session();
  session.scene_name = "<script>alert(1)</script>\"'&\xff\x01";
  session.events.push_back({5, "<who>", "</table><script>"});
  scene::Scene scene = made_up_scene();
  scene.set_description("a < b & \"c\"");
  const std::string html = report_html(session, scene, compute_metrics(session, scene));
  expect_sound(html);
  EXPECT_NE(html.find("&lt;script&gt;alert(1)"), std::string::npos);
  EXPECT_NE(html.find("&lt;b&gt;demo&lt;/b&gt; &amp; &#39;more&#39;"), std::string::npos);
}

TEST(Report, RepeatsWhatWasSaidAtLoad) {
  Session session = made_up_session();
  const scene::Scene scene = made_up_scene();
  EXPECT_EQ(report_html(session, scene, compute_metrics(session, scene)).find("Said at load"), std::string::npos);
  session.scene_text += "control { g_v_rad_s: 5000 }\n";
  const std::string html = report_html(session, scene, compute_metrics(session, scene));
  expect_sound(html);
  EXPECT_NE(html.find("Said at load:<ul>\n<li>control.g_v_rad_s = 5000 rad/s is above 3.14e+03"), std::string::npos);
}

TEST(Report, SurvivesEmptyAndBrokenSessions) {
  expect_sound(report_html(Session{}, scene::Scene{}, compute_metrics(Session{}, scene::Scene{})));
  const Session good = made_up_session();
  const scene::Scene scene = made_up_scene();
  using Field = double StationSample::*;
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity(), 1e300}) {
    Session session = good;
    session.master.resize(3000);
    session.slave.resize(3000);
    session.link.resize(3000);
    for (const Field field :
         {&StationSample::t_s, &StationSample::x_rad, &StationSample::f_nm, &StationSample::true_x_rad,
          &StationSample::true_f_nm, &StationSample::true_v_rad_s, &StationSample::x_cdob_rad, &StationSample::alpha,
          &StationSample::rtt_s, &StationSample::playout_delay_s}) {
      for (std::size_t k = 0; k < session.master.size(); k += 7)
        session.master[k].*field = session.slave[k].*field = bad;
    }
    for (std::size_t k = 0; k < session.link.size(); k += 5)
      session.link[k].achieved_delay_s = session.link[k].asked_delay_s = bad;
    session.clock_offset_bound_s = bad;
    expect_sound(report_html(session, scene, compute_metrics(session, scene)));
  }
}

TEST(Report, SaysInWordsWhatAPictureWouldShowEmpty) {
  Session session = made_up_session();
  session.link.clear();
  for (auto* side : {&session.master, &session.slave}) {
    for (StationSample& s : *side)
      s.true_x_rad = s.true_v_rad_s = s.true_f_nm = kNaN, s.x_cdob_rad = 0, s.alpha = 1, s.limits = 0;
  }
  const std::string html = report_html(session, made_up_scene(), compute_metrics(session, made_up_scene()));
  expect_sound(html);
  for (const auto* part :
       {"No packet from master to slave was recorded", "No communication disturbance was compensated",
        "alpha = 1 throughout", "true torques are not known", "No limit acted"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
}

struct GermanPunctuation : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Report, DoesNotDependOnTheLocale) {
  const Session session = made_up_session();
  const scene::Scene scene = made_up_scene();
  const std::string plain = report_html(session, scene, compute_metrics(session, scene));
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new GermanPunctuation));
  std::setlocale(LC_ALL, "de_DE.UTF-8");  // where installed
  const std::string german = report_html(session, scene, compute_metrics(session, scene));
  std::locale::global(before);
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(german, plain);
}

TEST(Decimate, KeepsEveryPeakWithinTheNumberOfPoints) {
  std::vector<double> x, y;
  for (int k = 0; k < 100000; ++k) x.push_back(k), y.push_back(std::sin(k * 0.001));
  y[31234] = 50;
  y[71234] = -50;
  const auto lines = decimate(x, y, 0, 99999, 800, 1e300);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_LE(lines[0].x.size(), 1600u);
  EXPECT_TRUE(std::is_sorted(lines[0].x.begin(), lines[0].x.end()));
  EXPECT_EQ(*std::max_element(lines[0].y.begin(), lines[0].y.end()), 50);
  EXPECT_EQ(*std::min_element(lines[0].y.begin(), lines[0].y.end()), -50);
}

TEST(Decimate, GapsStayGaps) {
  std::vector<double> x, y;
  for (int k = 0; k < 1000; ++k) {
    if (k >= 300 && k < 400) continue;  // a hole in x
    x.push_back(k);
    y.push_back(k >= 600 && k < 700 ? kNaN : 1.0);
  }
  const auto lines = decimate(x, y, 0, 999, 100, 5);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_LT(lines[0].x.back(), 300);
  EXPECT_GE(lines[1].x.front(), 400);
  EXPECT_LT(lines[1].x.back(), 600);
  EXPECT_GE(lines[2].x.front(), 700);
}

TEST(Decimate, ALoopIsThinnedBelowTheLimit) {
  std::vector<double> x, y;
  for (int k = 0; k < 200000; ++k) {
    x.push_back(std::cos(k * 0.37) * 500);
    y.push_back(std::sin(k * 0.41) * 500);
  }
  std::size_t points = 0;
  for (const Polyline& line : thin_out(x, y, 1, 1)) points += line.x.size();
  EXPECT_LE(points, kMaxPoints);
  EXPECT_GT(points, kMaxPoints / 4);
  for (std::size_t k = 1; k < y.size(); k += 2) y[k] = kNaN;
  points = 0;
  for (const Polyline& line : thin_out(x, y, 1, 1)) points += line.x.size();
  EXPECT_LE(points, kMaxPoints);
}

TEST(Ticks, AreOneTwoFive) {
  EXPECT_EQ(ticks(0, 10, 5, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(ticks(-0.3, 0.3, 3, false), (std::vector<double>{-0.2, 0, 0.2}));
  EXPECT_EQ(ticks(0.5, 200, 5, true), (std::vector<double>{0.5, 1, 2, 5, 10, 20, 50, 100, 200}));
  EXPECT_TRUE(ticks(1, 1, 5, false).empty());
  EXPECT_TRUE(ticks(kNaN, 1, 5, false).empty());
  EXPECT_TRUE(ticks(-1, 1, 5, true).empty());
}

TEST(Format, GivesThreeSignificantDigits) {
  EXPECT_EQ(three_digits(0), "0");
  EXPECT_EQ(three_digits(1), "1.00");
  EXPECT_EQ(three_digits(9.996), "10.0");
  EXPECT_EQ(three_digits(-0.01234), "-0.0123");
  EXPECT_EQ(three_digits(12345.6), "12346");
  EXPECT_EQ(three_digits(1.234e-7), "1.23e-07");
  EXPECT_EQ(three_digits(kNaN), "-");
  EXPECT_EQ(tick_label(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tick_label(-1e-18, 0.1), "0.0");
  EXPECT_EQ(tick_label(150, 50), "150");
  EXPECT_EQ(tick_label(2.5e-7, 5e-8), "2.5e-7");
  EXPECT_EQ(decade_label(1e-8), "1e-8");
  EXPECT_EQ(decade_label(1e-12), "1e-12");
  EXPECT_EQ(decade_label(5e-4), "5e-4");
  EXPECT_EQ(decade_label(0.02), "0.02");
  EXPECT_EQ(decade_label(10), "10");
  EXPECT_EQ(decade_label(1e6), "1e6");
  EXPECT_EQ(quantity(0.0023, "rad"), "2.30 mrad (0.132\u00b0)");
  EXPECT_EQ(quantity(0.05, "N m"), "50.0 mN m");
  EXPECT_EQ(quantity(1.5, "N m"), "1.50 N m");
}

TEST(Plot, LogAxesTreatWhatIsNotPositiveAsAGap) {
  Plot plot("Error against time", {"time (s)", 1e-3, 10, true}, {"error (1)", kNaN, kNaN, true});
  plot.line("method", {1e-3, 1e-2, 1e-1, 1, 10}, {1e-2, 1e-4, 0, 1e-6, -1}, Ink::kMaster);
  plot.points("method", {1e-3, 1e-2, 1e-1, 1, 0}, {1e-2, 1e-4, 0, 1e-6, 1e-3}, Ink::kSlave, Symbol::kCross);
  plot.rule(1e-5, "floor");
  const std::string svg = plot.svg();
  EXPECT_TRUE(well_formed("<!DOCTYPE html>" + svg));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_NE(svg.find(">floor<"), std::string::npos);
}

}  // namespace
}  // namespace farhand
