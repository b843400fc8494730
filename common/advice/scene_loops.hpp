// The loops of a scene as common/analysis knows them: each side in each contact that it meets, and both joined by the
// network.
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

// Free motion first, then what the slave touches within the run.
std::vector<Contact> contacts(const scene::Scene& scene);

// With the therapist's arm in it.
SideLoop master_loop(const scene::Scene& scene);
SideLoop direct_slave_loop(const scene::Scene& scene, const Contact& contact);
OrthosisLoop orthosis_loop(const scene::Scene& scene, const Contact& contact);

// f_1 and f_2 of this contact are named of it: a hand, not a wall.
bool names_thresholds(const scene::Scene& scene, const Contact& contact);
// One loop of four channels goes around both sides, and `teleoperator` is it.
bool joined_by_four_channels(const scene::Scene& scene);

// Spectral radius of the slave's loop, whichever device it is.
double slave_radius(const scene::Scene& scene, const Contact& contact);

// How long packets of this path are held so that nearly all arrive in their turn: the play-out's depth.
double needed_playout_s(const scene::Path& path);

// At rest in this contact, in the size of the master; nothing in free motion.
std::optional<SteadyContact> steady_contact(const scene::Scene& scene, const Contact& contact);

// The share of the compensation that stands in the master's law in this contact.
double alpha_in(const scene::Scene& scene, const Contact& contact);

Teleoperator teleoperator(const scene::Scene& scene, const Contact& contact);
TwoChannels two_channels(const scene::Scene& scene, const Contact& contact);

}  // namespace farhand
