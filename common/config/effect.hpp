// Which settings of a scene take effect at all. One that cannot is not taken silently. It is refused where somebody
// would rely on it: what a device does for the person in it, and who that person is. It is said as a warning where it
// belongs to another device or architecture than the scene names, or to something that is absent, so that one scene can
// be run with and without.
#pragma once

#include <string>
#include <vector>

#include "common/config/check.hpp"

namespace farhand {

// The scene must be complete. What is at its default asks for nothing.
std::vector<Complaint> refused_settings(const scene::Scene& scene);
std::vector<Complaint> idle_settings(const scene::Scene& scene);

// For what runs in real time. Throws std::invalid_argument, with a sentence for each setting that only virtual time can
// follow.
void refuse_virtual_time(const scene::Scene& scene);

// The same for a therapist's device behind an MCU, of which the scene says nothing.
void refuse_direct_drive_of_master(const scene::Scene& scene);

}  // namespace farhand
