// Fills in the defaults of a scene and finds every setting with which it cannot run. It does not know the file: a
// complaint names the field by its path.
#pragma once

#include <string>
#include <vector>

#include "proto/scene.pb.h"

namespace farhand {

struct Complaint {
  std::string path;      // slave.hand.stiffness_nm_per_rad, operator_acts[1].at_s; empty: the scene as a whole
  std::string sentence;  // begins with the name of the field
};

// Afterwards every field holds a value, except those that may stay absent. Fields without a default that were not
// given, values out of range and values that contradict each other are returned.
std::vector<Complaint> complete_and_check(scene::Scene& scene);

// Throws std::invalid_argument with a line for each, unless there is none.
void refuse(const std::vector<Complaint>& complaints);

}  // namespace farhand
