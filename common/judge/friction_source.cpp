#include "common/judge/friction_source.hpp"

#include <cmath>

#include "common/record/utc_text.hpp"

namespace farhand {

std::string friction_source(const DeviceFriction& box) {
  if (!std::isfinite(box.F_c_nm)) return "assumed: it was never measured";
  const std::string how = box.measured ? "measured " : "assumed from what was measured ";
  if (box.swept_utc_s == 0) return how + "in this run";
  const std::string when = utc_text(box.swept_utc_s);  // a recording may come from anywhere
  return how + (when.empty() ? "at no time" : "on " + when);
}

}  // namespace farhand
