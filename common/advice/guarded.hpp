// Where the bounds at the two persons hold. What is known of a torque or a speed too late bounds nothing: measured with
// an honest peer, a therapist was thrown with 10 rad/s and 21 W where his torque was known 50 ms late, and a patient
// with 10 rad/s at a tick of 20 ms. In virtual time such a scene runs, and says so; no program moves a person by it.
#pragma once

#include <string>
#include <vector>

#include "common/config/check.hpp"

namespace farhand {

// The scene must be complete.
std::vector<Complaint> unguarded_settings(const scene::Scene& scene);

// For what runs in real time. Throws std::invalid_argument, with a sentence for each.
void refuse_unguarded(const scene::Scene& scene);

}  // namespace farhand
