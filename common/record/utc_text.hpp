// A time in UTC, as people read it.
#pragma once

#include <cstdint>
#include <string>

namespace farhand {

// utc_s: since 1970. Like "2026-12-01T09:30:00Z"; empty for a time beyond all years.
std::string utc_text(std::int64_t utc_s);

}  // namespace farhand
