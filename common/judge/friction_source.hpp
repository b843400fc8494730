// What the friction of the patient's device rests on, in words.
#pragma once

#include <string>

#include "common/record/session.hpp"

namespace farhand {

// "measured on 2026-12-01T09:30:00Z", "measured in this run", "assumed from what was measured on ...", "assumed: it was
// never measured". The friction must not be absent.
std::string friction_source(const DeviceFriction& box);

}  // namespace farhand
