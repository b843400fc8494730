// A session whose hosts stall now and then, and what a person on either side feels of it, by the world's own truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/advice/warnings.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

struct StallCell {
  std::string architecture;
  bool elastic = false;  // the slave behind its MCU, else a direct drive
  int counts = 4096;     // of the encoders, per revolution
  std::string hand;      // N m/rad; empty: nothing in the orthosis
  std::string stalls;    // master or slave
  int stall_ms = 8;
  bool random = false;
  int every_ms = 60;
  std::string grip = "NORMAL";  // of the therapist

  std::string name() const {
    return architecture + (elastic ? " behind its MCU, " : " direct, ") + std::to_string(counts) + " counts, " + grip +
           " grip, " + (hand.empty() ? "nothing" : "hand " + hand) + ", " + stalls + " stopped " +
           std::to_string(stall_ms) + (random ? " ms at most at random, " : " ms, ") + std::to_string(every_ms) +
           " ms apart";
  }

  // Two channels, and four without compensation, are for networks next door.
  double delay_s() const { return architecture == "FOUR_CHANNEL" || architecture == "TWO_CHANNEL" ? 0.0 : 0.025; }

  static constexpr double kFrom_s = 1.6;  // the first stall, after engaging
  LoadedScene load(bool stalled = true, const std::vector<std::string>& more = {}) const {
    std::string text = "architecture: " + architecture + " duration_s: 6.5\n";
    if (elastic) text += "control { K_f_per_kgm2: 125 }\n";
    const std::string encoder = std::to_string(counts);
    const std::string host = " host { stall_s: " + std::to_string(1e-3 * stall_ms) +
                             " every_s: " + std::to_string(1e-3 * every_ms) +
                             " random: " + (random ? "true" : "false") + " from_s: " + std::to_string(kFrom_s) + " }\n";
    text += "master { motor { encoder_counts_per_rev: " + encoder + " } therapist { grip: " + grip +
            "\n"
            "intended { duration_s: 1.5 } intended { duration_s: 2 sine_amplitude_rad: 0.25 sine_frequency_hz: 0.5 }\n"
            "intended { duration_s: 1 ramp_to_rad: 0.25 } intended { duration_s: 2 } }\n" +
            (stalled && stalls == "master" ? host : "") + "}\n";
    text += "slave { device: " + std::string(elastic ? "SERIES_ELASTIC" : "DIRECT_DRIVE");
    text += " motor { encoder_counts_per_rev: " + encoder + " stop_min_rad: -0.5236 stop_max_rad: 0.5236 }\n";
    if (elastic)
      text += "series_elastic { joint_counts_per_rev: " + encoder + " motor_counts_per_rev: " + encoder + " }\n";
    if (!hand.empty()) text += "hand { stiffness_nm_per_rad: " + hand + " }\n";
    text += (stalled && stalls == "slave" ? host : "") + "}\n";
    const std::string path = "{ delay_s: " + std::to_string(delay_s()) + " distribution: CONSTANT }";
    text += "network { forward " + path + " backward " + path + " }\noperator_acts { at_s: 0.2 act: ENGAGE }\n";
    return load_scene_text(text, "stalled.txtpb", more);
  }
  // Says the program of this loop, before it runs, that it is unstable?
  bool told_unstable() const {
    const std::vector<std::string> said = warnings(load(false).scene);
    return std::any_of(said.begin(), said.end(),
                       [](const std::string& one) { return one.find(" unstable in ") != std::string::npos; });
  }
};

struct AtPersons {
  double therapist_nm = 0, patient_nm = 0;  // largest true torque
  std::uint32_t therapist_limits = 0, patient_limits = 0;
  double engaged = 0;    // share of the time from the first stall on, of the follower
  double reach_rad = 0;  // largest true angle of the orthosis
  double speed_rad_s = 0;
};

class PersonsWitness final : public Witness {
 public:
  void ticked(bool master, const Side& side, double t_s, OperatorAct) override {
    stalled(master, side, t_s);
    if (t_s < StallCell::kFrom_s) return;
    (master ? out.therapist_limits : out.patient_limits) |= side.trace().limits & kLimits;
    if (!master) ++ticks, engaged += side.trace().state == StationState::kEngaged ? 1 : 0;
    out.engaged = ticks > 0 ? engaged / ticks : 0;
  }
  void stalled(bool master, const Side& side, double t_s) override {
    if (t_s < StallCell::kFrom_s) return;
    const Truth truth = side.truth();
    double& most = master ? out.therapist_nm : out.patient_nm;
    most = std::max(most, std::abs(truth.f));
    if (master) return;
    out.reach_rad = std::max(out.reach_rad, std::abs(truth.x));
    out.speed_rad_s = std::max(out.speed_rad_s, std::abs(truth.v));
  }
  AtPersons out;

 private:
  double ticks = 0, engaged = 0;
};

inline AtPersons persons_of(const LoadedScene& loaded) {
  PersonsWitness witness;
  simulate(loaded, make_sides(loaded.scene), witness);
  return witness.out;
}

}  // namespace farhand
