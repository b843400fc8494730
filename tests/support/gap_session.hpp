// A session in virtual time over a line that is cut once, and what the two persons feel of what follows, by the world's
// own truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/unexplained_step.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {

inline constexpr const char* kSituations[] = {"free, both at rest", "free, in motion",   "in contact",
                                              "at first touch",     "therapist goes on", "patient moves",
                                              "patient lets go",    "therapist lets go"};
inline constexpr int kSituationCount = std::size(kSituations);

struct GapCell {
  int situation = 0;
  bool elastic = false;  // the slave behind its MCU, else a direct drive
  double gap_s = 0.3;
  bool forward = true, backward = true;  // which ways are cut
  double delay_s = 0.02, jitter_s = 0.0;
  std::string architecture = "MODEL_MEDIATED", grip = "NORMAL";
  std::uint64_t seed = 1;

  static constexpr double kCut_s = 4.0;

  std::string text() const {
    char line[200];
    std::snprintf(line, sizeof line, "%s, %s, %s, %s grip, gap %.3f s%s, %.0f +- %.0f ms, seed %llu",
                  kSituations[situation], elastic ? "MCU" : "direct", architecture.c_str(), grip.c_str(), gap_s,
                  forward && backward ? ""
                  : forward           ? " forward"
                                      : " backward",
                  1e3 * delay_s, 1e3 * jitter_s, static_cast<unsigned long long>(seed));
    return line;
  }

  LoadedScene load() const {
    std::mt19937_64 bits(seed + 7919 * static_cast<std::uint64_t>(situation));
    const auto number = [](double value) { return std::to_string(value); };
    // Within the gap, from a little before it to its end: when a person does something else.
    const double when = kCut_s + uniform(bits, -0.05, gap_s), side = uniform(bits, -1, 1) < 0 ? -1 : 1;
    const auto ramp = [&](double duration, double to) {
      return " intended { duration_s: " + number(duration) + " ramp_to_rad: " + number(side * to) + " }";
    };
    const auto rest = [&](double duration) { return " intended { duration_s: " + number(duration) + " }"; };
    std::string moves = rest(20), hand, wall;
    const double stiffness = uniform(bits, 0.5, 4);
    switch (situation) {
      case 0:
        moves = ramp(3, uniform(bits, 0, 0.2)) + rest(20);
        break;
      case 1:
        moves = rest(1.5) + " intended { duration_s: 20 sine_amplitude_rad: " + number(uniform(bits, 0.05, 0.2)) +
                " sine_frequency_hz: " + number(uniform(bits, 0.1, 0.4)) + " }";
        break;
      case 2:
        hand = number(stiffness);
        moves = rest(1) + ramp(2, uniform(bits, 0.03, 0.2)) + rest(20);
        break;
      case 3:
        wall = number(side * 0.1);
        moves = rest(when - 1) + ramp(2, uniform(bits, 0.2, 0.3)) + rest(20);
        break;
      case 4:
        hand = number(stiffness);
        moves =
            rest(1) + ramp(2, 0.05) + rest(when - 3) + ramp(uniform(bits, 0.5, 2), uniform(bits, 0.1, 0.25)) + rest(20);
        break;
      case 5:
        hand = number(stiffness) + " rest_amplitude_rad: " + number(uniform(bits, 0.02, 0.15)) +
               " rest_frequency_hz: " + number(uniform(bits, 0.1, 0.4));
        break;
      case 6:
        hand = number(stiffness) + " until_s: " + number(when);
        moves = rest(1) + ramp(2, uniform(bits, 0.03, 0.2)) + rest(20);
        break;
      default:
        hand = number(stiffness);
        moves = rest(1) + ramp(2, uniform(bits, 0.03, 0.2)) + rest(when - 3) + ramp(0.3, 0) + rest(20);
        break;
    }
    std::string scene = "architecture: " + architecture + " duration_s: 7.5 seed: " + std::to_string(seed) + "\n";
    if (elastic) scene += "control { K_f_per_kgm2: 125 }\n";
    scene += "master { therapist { grip: " + grip + moves + " } }\n";
    scene += std::string("slave { device: ") + (elastic ? "SERIES_ELASTIC" : "DIRECT_DRIVE") +
             " motor { stop_min_rad: -0.5236 stop_max_rad: 0.5236 }";
    if (!hand.empty()) scene += " hand { stiffness_nm_per_rad: " + hand + " }";
    if (!wall.empty()) scene += " wall { stiffness_nm_per_rad: 30 at_rad: " + wall + " }";
    const auto path = [&](bool cut) {
      return " { delay_s: " + number(delay_s) + " jitter_s: " + number(jitter_s) +
             (cut ? " cut_from_s: " + number(kCut_s) + " cut_until_s: " + number(kCut_s + gap_s) : std::string()) +
             " }";
    };
    scene += " }\nnetwork { forward" + path(forward) + " backward" + path(backward) + " }\n";
    return load_scene_text(scene + "operator_acts { at_s: 0.2 act: ENGAGE }\n", "gap.txtpb");
  }
};

struct AfterTheGap {
  bool engaged_before = false, held = false;
  bool stayed = false;    // both persons, as resumption asks, until it should be over
  double resumed_s = -1;  // both engaged again, after the link's return; < 0: not
  double jump_rad = 0;    // of the motion followed, beyond what velocity explains
  std::string more_at = {}, jump_at = {};
  double more_engaged_nm = -10;
  double more_nm = -10;  // true torque in the first 0.1 s of each of its states, above the most of Holding
};

class GapWitness final : public Witness {
 public:
  explicit GapWitness(const GapCell& cell) : back_s_(GapCell::kCut_s + cell.gap_s) {}

  void ticked(bool master, const Side& side, double t_s, OperatorAct) override {
    Person& p = person_[master ? 0 : 1];
    const TickTrace<1>& now = side.trace();
    const Truth truth = side.truth();
    const S before = std::exchange(p.state, now.state);
    if (t_s < GapCell::kCut_s) {
      out.engaged_before = person_[0].state == S::kEngaged && person_[1].state == S::kEngaged;
      p.x_gap = truth.x;
    } else {
      out.held = out.held || p.state == S::kHolding;
      if (p.state == S::kHolding) p.held_nm = std::max(p.held_nm, std::abs(truth.f));
      if (p.state != before && before == S::kHolding) p.left_s = t_s;
      const double more = std::abs(truth.f) - p.held_nm;
      if (p.left_s > 0 && t_s < p.left_s + 0.1 && more > out.more_nm) {
        out.more_nm = more;
        out.more_at = std::string(master ? "therapist " : "patient ") + name_of(p.state);
      }
      if (p.state != before && p.state == S::kEngaged && p.left_s > 0) p.engaged_s = t_s;
      if (p.engaged_s > 0 && t_s < p.engaged_s + 0.1) out.more_engaged_nm = std::max(out.more_engaged_nm, more);
      const double jump = unexplained_step(now.target.x[0] - p.last.target.x[0], 1e-3,
                                           {p.last.local.v[0], now.local.v[0], p.last.remote.v[0], now.remote.v[0],
                                            p.last.target.v[0], now.target.v[0]});
      if (p.state == S::kHolding) p.held = true;
      if (p.held && jump > out.jump_rad) {
        out.jump_rad = jump;
        out.jump_at = std::string(master ? "therapist " : "patient ") + name_of(before) + " to " + name_of(p.state) +
                      " at " + std::to_string(t_s);
      }
      if (!both_engaged()) p.moved = std::max(p.moved, std::abs(truth.x - p.x_gap));
      if (t_s < back_s_ + 0.25 && t_s > back_s_ - 1e-3) p.fastest = std::max(p.fastest, std::abs(truth.v));
    }
    p.x = truth.x;
    p.last = now;
    if (master || t_s < GapCell::kCut_s) return;
    if (t_s >= back_s_ && t_s < back_s_ + 0.5 && !both_engaged())
      apart_ = std::max(apart_, std::abs(person_[0].x - person_[1].x));
    if (out.held && both_engaged() && out.resumed_s < 0) out.resumed_s = t_s - back_s_;
    out.stayed = apart_ <= 0.95 * 0.0873 && std::max(person_[0].moved, person_[1].moved) <= 0.95 * 0.0524 &&
                 std::max(person_[0].fastest, person_[1].fastest) <= 0.2;
  }
  AfterTheGap out;

 private:
  using S = StationState;
  bool both_engaged() const { return person_[0].state == S::kEngaged && person_[1].state == S::kEngaged; }
  struct Person {
    S state = S::kOff;
    TickTrace<1> last;
    bool held = false;
    double x = 0, x_gap = 0, moved = 0, fastest = 0, held_nm = 0, left_s = -1, engaged_s = -1;
  };
  double back_s_, apart_ = 0;
  std::array<Person, 2> person_;
};

inline AfterTheGap after_the_gap(const GapCell& cell) {
  GapWitness witness(cell);
  const LoadedScene loaded = cell.load();
  simulate(loaded, make_sides(loaded.scene), witness);
  return witness.out;
}

}  // namespace farhand
