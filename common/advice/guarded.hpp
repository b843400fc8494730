// Settings with which the bounds at the two persons hold. A bound does not work if torque or speed is known too late:
// measured with an honest peer, a therapist was thrown with 10 rad/s and 21 W when his torque was known 50 ms late, and
// a patient with 10 rad/s at a tick of 20 ms. Virtual time runs such a scene, with a warning; no program moves a person
// with it.
#pragma once

#include <string>
#include <vector>

#include "common/config/check.hpp"

namespace farhand {

// The scene must be complete.
std::vector<Complaint> unguarded_settings(const scene::Scene& scene);

// For programs that run in real time. Throws std::invalid_argument, with a sentence for each setting.
void refuse_unguarded(const scene::Scene& scene);

}  // namespace farhand
