// Finds settings of a scene that have no effect. None is ignored silently. A setting is refused if somebody would rely
// on it: protection of a person by a device, and properties of that person. It gives a warning if it belongs to another
// device or architecture than those of the scene, or to an absent part, so that one scene can be run with and without
// that part.
#pragma once

#include <string>
#include <vector>

#include "common/config/check.hpp"

namespace farhand {

// The scene must be complete. A setting at its default is never refused.
std::vector<Complaint> refused_settings(const scene::Scene& scene);
std::vector<Complaint> idle_settings(const scene::Scene& scene);

// For programs that run in real time. Throws std::invalid_argument, with a sentence for each setting that only virtual
// time can follow.
void refuse_virtual_time(const scene::Scene& scene);

// The same for a therapist's device behind an MCU, for which the scene has no settings.
void refuse_direct_drive_of_master(const scene::Scene& scene);

}  // namespace farhand
