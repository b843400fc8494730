#include "common/secure/places.hpp"

#include <algorithm>

namespace farhand {
namespace {

std::size_t held_by(std::span<const PlaceTaken> taken, const UdpHost& host) noexcept {
  return static_cast<std::size_t>(
      std::count_if(taken.begin(), taken.end(), [&](const PlaceTaken& place) { return place.host == host; }));
}

}  // namespace

std::optional<std::size_t> who_makes_room(std::span<const PlaceTaken> taken, const UdpHost& newcomer,
                                          Nanoseconds now) noexcept {
  const std::size_t own = held_by(taken, newcomer);
  std::optional<std::size_t> found;
  std::size_t most = 0;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (taken[i].authentic) continue;
    const std::size_t held = held_by(taken, taken[i].host);
    if (held < own) continue;
    // Its host would still have as many as the newcomer's; or it has had its time.
    if (held < own + 2 && now - taken[i].since < kPlaceFor) continue;
    if (found && (held < most || (held == most && taken[i].since >= taken[*found].since))) continue;
    found = i;
    most = held;
  }
  return found;
}

}  // namespace farhand
