#include "common/record/utc_text.hpp"

#include <ctime>

namespace farhand {

std::string utc_text(std::int64_t utc_s) {
  const std::time_t time = utc_s;
  std::tm parts{};
  char text[40];
  const bool exists = ::gmtime_r(&time, &parts) != nullptr;
  return exists && std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) != 0 ? text : "";
}

}  // namespace farhand
