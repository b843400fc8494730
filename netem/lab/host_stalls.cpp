#include "netem/lab/host_stalls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farhand {
namespace {

constexpr std::uint64_t kMasters = 0x6D61737465720000u, kSlaves = 0x736C617665000000u;

const scene::Host& host_of(const scene::Scene& scene, bool master) {
  return master ? scene.master().host() : scene.slave().host();
}

}  // namespace

HostStalls::HostStalls(const scene::Scene& scene, bool master)
    : any_(master ? scene.master().has_host() : scene.slave().has_host()),
      random_(host_of(scene, master).random()),
      longest_s_(host_of(scene, master).stall_s()),
      every_s_(host_of(scene, master).every_s()),
      state_(scene.seed() ^ (master ? kMasters : kSlaves)),
      first_(from_seconds(host_of(scene, master).from_s())) {
  until_ = from_ = any_ ? std::numeric_limits<Nanoseconds>::min() : std::numeric_limits<Nanoseconds>::max();
}

void HostStalls::next() noexcept {
  if (!random_) {
    from_ = first_ + from_seconds(every_s_ * static_cast<double>(count_++));
    until_ = from_ + from_seconds(longest_s_);
    return;
  }
  const double between_s = -std::log(unit()) * std::max(every_s_ - 0.5 * longest_s_, 0.0);
  from_ = std::max(first_, until_) + from_seconds(between_s);
  until_ = from_ + std::max<Nanoseconds>(1, from_seconds(unit() * longest_s_));
}

// SplitMix64 (Steele, Lea & Flood 2014), so that a seed stalls alike everywhere.
double HostStalls::unit() noexcept {
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  z ^= z >> 31;
  return (static_cast<double>(z >> 12) + 0.5) * 0x1p-52;
}

}  // namespace farhand
