// One cell of the contacts that an architecture is tried on: free motion, then a hand, a wall or nothing.
#pragma once

#include <string>
#include <vector>

#include "common/config/load.hpp"

namespace farhand {

struct ContactCell {
  double delay_s;           // each way
  std::string environment;  // free, wall 1e3, wall 1e4, or the stiffness of a hand in N m/rad
  std::string grip;
  int seed;

  std::string name() const {
    return std::to_string(delay_s) + " s, " + environment + ", " + grip + ", seed " + std::to_string(seed);
  }
  double until_s() const { return 26 + 10 * delay_s; }
};

// constant: else +-50 % of jitter and 10 % of loss.
inline LoadedScene load_scene(const std::string& scene, const ContactCell& cell, bool constant = false,
                              const std::vector<std::string>& more = {}) {
  const std::string delay = std::to_string(cell.delay_s), until = std::to_string(cell.until_s());
  const std::string path =
      "{delay_s: " + delay + (constant ? "}" : " jitter_s: " + std::to_string(0.5 * cell.delay_s) + " loss: 0.1}");
  std::vector<std::string> sets{"master.therapist.grip=" + cell.grip, "network.forward=" + path,
                                "network.backward=" + path, "duration_s=" + until, "windows.contact.until_s=" + until};
  if (cell.environment.starts_with("wall")) {
    const std::string wall = cell.environment == "wall 1e3" ? "{stiffness_nm_per_rad: 1e3 damping_nms_per_rad: 0.4"
                                                            : "{stiffness_nm_per_rad: 1e4 damping_nms_per_rad: 1.26";
    sets.insert(sets.end(), {"slave.hand.from_s=1000", "slave.wall=" + wall + " at_rad: 0.1}",
                             "master.therapist.intended[1].sine_amplitude_rad=0.09",
                             "master.therapist.intended[3].ramp_to_rad=0.25"});
  } else if (cell.environment == "free") {
    sets.push_back("slave.hand.from_s=1000");
  } else {
    sets.push_back("slave.hand.stiffness_nm_per_rad=" + cell.environment);
  }
  sets.insert(sets.end(), more.begin(), more.end());
  LoadedScene loaded = load_scene(scene, sets);
  loaded.scene.set_seed(static_cast<std::uint64_t>(cell.seed));
  return loaded;
}

// each(cell): over all environments and grips.
template <class Each>
void each_contact_cell(const std::vector<double>& delays_s, int seeds, bool free, Each&& each) {
  for (const double delay_s : delays_s) {
    for (const char* environment : {"free", "0.5", "2", "5", "wall 1e3", "wall 1e4"}) {
      if (!free && environment == std::string("free")) continue;
      for (const char* grip : {"LIGHT", "NORMAL", "FIRM"}) {
        for (int seed = 1; seed <= seeds; ++seed) each(ContactCell{delay_s, environment, grip, seed});
      }
    }
  }
}

}  // namespace farhand
