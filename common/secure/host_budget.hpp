// Limits the datagrams of handshakes that one host may send. The queue before the handshake thread is short, and
// without a budget one host could fill it. Hosts share a fixed number of buckets by a hash that is drawn anew at each
// start, so that no host can aim at the bucket of another.
//
//   A bucket holds the time until which it is used up (generic cell rate algorithm): each datagram moves this time on
//   by 1/rate, and it may lie ahead of the clock by at most a burst.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/link/udp.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

class HostBudget {
 public:
  static constexpr Nanoseconds kEach = kSecond / 2000;
  static constexpr int kBurst = 64;
  static constexpr std::size_t kBuckets = 256;

  explicit HostBudget(std::uint64_t seed) noexcept : seed_(seed) {}

  // Returns true if this datagram is within the budget of its host, and takes it from the budget.
  bool take(const UdpEndpoint& from, Nanoseconds now) noexcept {
    Nanoseconds& spent_until = buckets_[bucket_of(from)];
    if (spent_until < now) spent_until = now;
    if (spent_until - now > (kBurst - 1) * kEach) return false;
    spent_until += kEach;
    return true;
  }

  std::size_t bucket_of(const UdpEndpoint& from) const noexcept {
    const UdpHost host = host_of(from);
    std::uint64_t hash = seed_ ^ (host.v6 ? 1 : 0);
    for (const std::uint8_t byte : host.network) hash = mixed(hash ^ byte);
    return hash % kBuckets;
  }

 private:
  // The last step of splitmix64: every bit of the argument reaches every bit of the result.
  static std::uint64_t mixed(std::uint64_t z) noexcept {
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
  }

  std::uint64_t seed_;
  std::array<Nanoseconds, kBuckets> buckets_{};
};

}  // namespace farhand
