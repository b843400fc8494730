// Strangers fill whatever has places: those of handshakes, and the queue before them. What one host can take from the
// others, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "common/secure/dtls.hpp"
#include "common/secure/host_budget.hpp"
#include "common/secure/places.hpp"
#include "tests/support/handshake_network.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using Party = HandshakeNetwork::Party;

const PairingKey kKey = PairingKey::from_text(std::string(63, '5') + "7");
const PairingKey kOtherKey = PairingKey::from_text(std::string(63, '5') + "8");

UdpEndpoint at(int host, int port) {
  UdpEndpoint e = endpoint(static_cast<std::uint16_t>(port));
  e.address[2] = static_cast<std::uint8_t>(host >> 8), e.address[3] = static_cast<std::uint8_t>(host);
  return e;
}
PlaceTaken taken(int host, Nanoseconds since, bool authentic = false) {
  return {host_of(at(host, 1)), since, authentic};
}

// Places.

TEST(Places, AreGivenUpByTheHostThatHoldsTheMostAtOnce) {
  const std::vector<PlaceTaken> places{taken(1, 5), taken(2, 9), taken(2, 7), taken(2, 8)};
  EXPECT_EQ(who_makes_room(places, host_of(at(3, 1)), 10), 2u) << "the oldest of the host with three";
  EXPECT_EQ(who_makes_room(places, host_of(at(1, 2)), 10), 2u) << "its second";
  EXPECT_EQ(who_makes_room(places, host_of(at(2, 2)), 10), std::nullopt) << "none is old, and it has the most itself";
}

TEST(Places, OfOneHostGoToTheNewestOnceTheOldestHadItsTime) {
  const std::vector<PlaceTaken> places{taken(2, 9), taken(2, 7), taken(2, 8)};
  EXPECT_EQ(who_makes_room(places, host_of(at(2, 1)), 7 + kPlaceFor - 1), std::nullopt);
  EXPECT_EQ(who_makes_room(places, host_of(at(2, 1)), 7 + kPlaceFor), 1u);
  const std::vector<PlaceTaken> one_each{taken(1, 9), taken(2, 7), taken(3, 8)};
  EXPECT_EQ(who_makes_room(one_each, host_of(at(4, 1)), 7 + kPlaceFor - 1), std::nullopt);
  EXPECT_EQ(who_makes_room(one_each, host_of(at(4, 1)), 7 + kPlaceFor), 1u);
}

TEST(Places, AreNeverTakenFromWhoeverKnowsTheKeyNorFromAHostWithFewer) {
  const std::vector<PlaceTaken> places{taken(1, 0, true), taken(2, 0, true), taken(2, 0, true), taken(3, 0)};
  EXPECT_EQ(who_makes_room(places, host_of(at(4, 1)), 10 * kSecond), 3u);
  EXPECT_EQ(who_makes_room(std::span(places).first(3), host_of(at(4, 1)), 10 * kSecond), std::nullopt);
  EXPECT_EQ(who_makes_room(places, host_of(at(2, 9)), 10 * kSecond), std::nullopt) << "host 3 has fewer than host 2";
}

// Against the rule as it is meant, over random tables and hosts that come at random.
TEST(Places, AreSharedFairlyWhateverComes) {
  std::mt19937_64 bits(7);
  const auto below = [&](int n) { return static_cast<int>(uniform(bits, 0, n)); };
  for (int c = 0; c < 2000; ++c) {
    std::vector<PlaceTaken> places;
    const int hosts = 1 + below(10), size = 2 + below(30);
    Nanoseconds now = 0;
    for (int step = 0; step < 200; ++step) {
      now += static_cast<Nanoseconds>(uniform(bits, 0, 0.3) * kSecond);
      const int host = below(hosts);
      std::map<int, int> before;
      for (const PlaceTaken& place : places) ++before[place.host.network[3]];
      if (static_cast<int>(places.size()) < size) {
        places.push_back(taken(host, now));
        continue;
      }
      const auto room = who_makes_room(places, host_of(at(host, 1)), now);
      int most = 0;
      for (const auto& [h, n] : before) most = std::max(most, n);
      if (!room) {
        EXPECT_GE(before[host] + 1, most) << "only a host with the most, or one less, is turned away";
        continue;
      }
      const PlaceTaken gone = places[*room];
      EXPECT_GE(before[gone.host.network[3]], before[host]);
      const bool had_its_time = now - gone.since >= kPlaceFor;
      EXPECT_TRUE(had_its_time || before[gone.host.network[3]] >= before[host] + 2);
      places[*room] = taken(host, now);
    }
  }
}

// The queue.

TEST(HostBudget, IsABurstAndThenARateForEachHostWhateverItsPorts) {
  HostBudget budget(1);
  int taken_at_once = 0;
  for (int i = 0; i < 1000; ++i) taken_at_once += budget.take(at(1, 1 + i), kSecond) ? 1 : 0;
  EXPECT_EQ(taken_at_once, HostBudget::kBurst);
  int in_a_second = 0;
  for (int i = 0; i < 100'000; ++i)
    in_a_second += budget.take(at(1, i % 60'000), kSecond + i * (kSecond / 100'000)) ? 1 : 0;
  EXPECT_NEAR(in_a_second, kSecond / HostBudget::kEach, 1);
  EXPECT_TRUE(budget.take(at(1, 1), 10 * kSecond)) << "and is whole again after a pause";
}

TEST(HostBudget, OfOneHostIsNotUsedByAnother) {
  constexpr int kHosts = 1000;
  int undisturbed = 0, differs = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    HostBudget budget(seed), other(seed + 1000);
    for (int i = 0; i < 10'000; ++i) budget.take(at(0, 1), kSecond);
    for (int host = 1; host <= kHosts; ++host) {
      undisturbed += budget.take(at(host, 1), kSecond) ? 1 : 0;
      differs += budget.bucket_of(at(host, 1)) != other.bucket_of(at(host, 1)) ? 1 : 0;
    }
  }
  // But for those that share its bucket, one in 256: which, nobody can know.
  EXPECT_GT(undisturbed, 20 * kHosts * 98 / 100);
  EXPECT_GT(differs, 20 * kHosts * 98 / 100);
}

// The whole.

struct Crowd {
  int hosts = 1, ports = 8;
  double hellos_per_s = 11;
  double one_way_s = 0;
  bool box_beside_it = false;  // behind the same address
};

// Callers that have fetched their cookies and begin again and again, near the listener. How long the right box then
// takes, or nothing after 10 s.
std::optional<double> box_gets_in_after(const Crowd& crowd) {
  const auto greeting = [](Role role) {
    return Greeting{.role = role, .configuration = "0123456789abcdef", .program = "1.2.3"};
  };
  HandshakeNetwork network({.delay_s = crowd.one_way_s}, 1);
  Party& listener = network.add(Handshaker::listener(kKey, greeting(Role::kLeader)), kListenerAt);
  DtlsContext context(LinkEnd::kDialer, kOtherKey);
  std::vector<std::pair<UdpEndpoint, Bytes>> hellos;
  for (int i = 0; i < crowd.hosts * crowd.ports; ++i) {
    const UdpEndpoint from = at(1 + i % crowd.hosts, 3000 + i / crowd.hosts);
    Dtls caller(context);
    caller.step();
    HandshakeDatagram cookie;
    listener.handshaker->receive(to_datagram(from, caller.take_written().at(0)), network.now());
    if (!listener.handshaker->take_outgoing(cookie)) throw std::logic_error("no cookie");
    caller.step(cookie.view());
    hellos.emplace_back(from, caller.take_written().at(0));
  }
  std::mt19937_64 bits(3);
  double owed = 0;
  std::size_t next = 0;
  const auto press_on = [&] {
    for (owed += 1e-3 * crowd.hellos_per_s; owed >= 1; --owed) {
      auto& [from, hello] = hellos[next++ % hellos.size()];
      constexpr std::size_t kRandomAt = 27;  // what makes it another hello
      for (std::size_t i = 0; i < 32; ++i) hello[kRandomAt + i] = static_cast<std::byte>(bits());
      network.inject(from, kListenerAt, hello);
    }
  };
  for (int ms = 0; ms < 3000; ++ms) {
    press_on();
    network.run(kMillisecond);
  }
  EXPECT_TRUE(listener.sessions.empty());
  const UdpEndpoint box_at = at(crowd.box_beside_it ? 1 : 0, 1000);
  Party& box = network.add(Handshaker::dialer(kKey, greeting(Role::kFollower), kListenerAt), box_at);
  for (int ms = 0; ms < 10'000; ++ms) {
    press_on();
    network.run(kMillisecond);
    if (!box.sessions.empty() && !listener.sessions.empty()) {
      EXPECT_TRUE(share_keys(*box.sessions[0], *listener.sessions[0]));
      return 1e-3 * ms;
    }
  }
  return std::nullopt;
}

void gets_in(const Crowd& crowd) {
  const std::optional<double> took = box_gets_in_after(crowd);
  std::printf("%d hosts of %d ports, %.0f hellos a second, %.0f ms one way, box %s: %s s\n", crowd.hosts, crowd.ports,
              crowd.hellos_per_s, 1e3 * crowd.one_way_s, crowd.box_beside_it ? "behind the same address" : "elsewhere",
              took ? std::to_string(*took).c_str() : "more than 10");
  EXPECT_TRUE(took);
}

TEST(CrowdedLink, PortsOfOneHostDoNotKeepTheRightBoxOut) {
  for (const double one_way_s : {0.0, 0.5}) {
    gets_in({.ports = 8, .hellos_per_s = 11, .one_way_s = one_way_s});
    gets_in({.ports = 8, .hellos_per_s = 11, .one_way_s = one_way_s, .box_beside_it = true});
    gets_in({.ports = 64, .hellos_per_s = 1000, .one_way_s = one_way_s, .box_beside_it = true});
  }
}

// More ports than places.
TEST(CrowdedLink, NeitherDoManyMorePortsOfAnotherHost) {
  gets_in({.ports = 400, .hellos_per_s = 1000, .one_way_s = 0.5});
}

TEST(NightlyCrowdedLink, TheRightBoxGetsInWithinTenSeconds) {
  for (const double one_way_s : {0.0, 0.5}) {
    for (const bool beside : {false, true}) {
      for (const int ports : {8, 64}) {
        for (const double rate : {11.0, 30.0, 100.0, 300.0, 1000.0}) {
          gets_in({.ports = ports, .hellos_per_s = rate, .one_way_s = one_way_s, .box_beside_it = beside});
        }
      }
    }
    gets_in({.ports = 4000, .hellos_per_s = 1000, .one_way_s = one_way_s});
    gets_in({.hosts = 64, .ports = 8, .hellos_per_s = 1000, .one_way_s = one_way_s});
  }
}

}  // namespace
}  // namespace farhand
