#include "common/judge/friction_source.hpp"

#include <cmath>
#include <ctime>

namespace farhand {

std::string friction_source(const DeviceFriction& box) {
  if (!std::isfinite(box.F_c_nm)) return "assumed: it was never measured";
  const std::string how = box.measured ? "measured " : "assumed from what was measured ";
  if (box.swept_utc_s == 0) return how + "in this run";
  const std::time_t time = box.swept_utc_s;
  std::tm parts{};
  char text[40];
  // A recording may come from anywhere, and hold a time beyond all years.
  if (::gmtime_r(&time, &parts) == nullptr || std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) == 0)
    return how + "at no time";
  return how + "on " + text;
}

}  // namespace farhand
