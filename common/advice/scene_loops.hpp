// The loops of a scene in the form of common/analysis: each side in each contact that it meets, and both sides joined
// by the network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/analysis/steady_contact.hpp"
#include "common/analysis/teleoperator.hpp"
#include "proto/scene.pb.h"

namespace farhand {

struct Contact {
  std::string name;  // "free motion", "contact with slave.hand.stiffness_nm_per_rad = 5"
  double k = 0, b = 0, rest = 0;
  double from_s = 0, until_s = 0;
  bool one_sided = false;
};

// Free motion first, then the objects that the slave touches within the run.
std::vector<Contact> contacts(const scene::Scene& scene);

// The master's loop, with the therapist's arm.
SideLoop master_loop(const scene::Scene& scene);
SideLoop direct_slave_loop(const scene::Scene& scene, const Contact& contact);
OrthosisLoop orthosis_loop(const scene::Scene& scene, const Contact& contact);

// True if f_1 and f_2 are estimated from this contact: a hand, not a wall.
bool names_thresholds(const scene::Scene& scene, const Contact& contact);
// True if one loop of four channels goes around both sides; `teleoperator` returns it.
bool joined_by_four_channels(const scene::Scene& scene);

// Spectral radius of the slave's loop, for either device.
double slave_radius(const scene::Scene& scene, const Contact& contact);

// Depth of the play-out for this path: the time for which packets are held so that nearly all arrive in their turn, s.
double needed_playout_s(const scene::Path& path);

// The state of rest in this contact, in the size of the master; empty in free motion.
std::optional<SteadyContact> steady_contact(const scene::Scene& scene, const Contact& contact);

// The share of the compensation that the master's law uses in this contact.
double alpha_in(const scene::Scene& scene, const Contact& contact);

Teleoperator teleoperator(const scene::Scene& scene, const Contact& contact);
TwoChannels two_channels(const scene::Scene& scene, const Contact& contact);

}  // namespace farhand
