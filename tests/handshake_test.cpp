// Handshakes between the two ends over a simulated network in virtual time: through loss and delay, with the wrong key,
// with peers that do not fit, and against someone on the path.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "common/secure/dtls.hpp"
#include "tests/support/handshake_network.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using Kind = HandshakeEvent::Kind;
using Party = HandshakeNetwork::Party;

const PairingKey kKey = PairingKey::from_text(std::string(63, '3') + "7");
const PairingKey kOtherKey = PairingKey::from_text(std::string(63, '3') + "8");

Greeting therapist() { return {.role = Role::kLeader, .configuration = "0123456789abcdef", .program = "1.2.3"}; }
Greeting patient() {
  Greeting greeting = therapist();
  greeting.role = Role::kFollower;
  return greeting;
}

struct Pair {
  HandshakeNetwork network;
  Party &dialer, &listener;

  explicit Pair(const LinkModelParams& link, std::uint64_t seed = 1, const PairingKey& dialer_key = kKey,
                const Greeting& dialer_greeting = patient())
      : network(link, seed),
        dialer(network.add(Handshaker::dialer(dialer_key, dialer_greeting, kListenerAt), kDialerAt)),
        listener(network.add(Handshaker::listener(kKey, therapist()), kListenerAt)) {}

  // The dialer may agree while its last word is lost for good. It then hears nothing and gives its session back, as the
  // channel does.
  bool both_agree(Nanoseconds at_most) {
    Nanoseconds silent_since = network.now();
    std::size_t sessions = dialer.sessions.size();
    return network.run_until(
        [&] {
          if (dialer.sessions.size() != sessions) silent_since = network.now();
          sessions = dialer.sessions.size();
          if (dialer.sessions.empty()) return false;
          if (!listener.sessions.empty() && share_keys(*dialer.sessions.back(), *listener.sessions.back())) return true;
          if (network.now() - silent_since == 5 * kSecond) {
            dialer.handshaker->give_back(std::move(dialer.sessions.back()), network.now());
            dialer.sessions.pop_back();
          }
          return false;
        },
        at_most);
  }
};

TEST(Handshake, EndsInSharedKeysAfterThreeAndAHalfRoundTrips) {
  Pair pair({.delay_s = 0.05});
  const Nanoseconds begin = pair.network.now();
  ASSERT_TRUE(pair.both_agree(kSecond));
  const double took_ms = 1e-6 * static_cast<double>(pair.network.now() - begin);
  std::printf("agreed after %.0f ms over 50 ms each way, %d and %d datagrams\n", took_ms, pair.dialer.sent,
              pair.listener.sent);
  EXPECT_GE(took_ms, 350);  // hello, hello with cookie, keys: three times there and back; and the dialer's greeting
  EXPECT_LT(took_ms, 370);
  EXPECT_TRUE(share_keys(*pair.dialer.sessions[0], *pair.listener.sessions[0]));
  EXPECT_TRUE(share_keys(*pair.listener.sessions[0], *pair.dialer.sessions[0]));
  EXPECT_EQ(pair.dialer.sessions[0]->peer(), kListenerAt);
  EXPECT_EQ(pair.listener.sessions[0]->peer(), kDialerAt);
}

TEST(Handshake, SucceedsThroughLossAndDelay) {
  constexpr int kRuns = 100;
  for (const auto& [delay, loss] : {std::pair{0.05, 0.3}, std::pair{0.5, 0.3}, std::pair{0.01, 0.5}}) {
    std::vector<double> took_s;
    for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
      Pair pair({.delay_s = delay, .jitter_s = delay / 2, .loss = loss}, seed);
      const Nanoseconds begin = pair.network.now();
      ASSERT_TRUE(pair.both_agree(120 * kSecond)) << "loss " << loss << " seed " << seed;
      took_s.push_back(to_seconds(pair.network.now() - begin));
    }
    std::sort(took_s.begin(), took_s.end());
    std::printf("%.0f %% loss, %.0f +-%.0f ms each way: median %.2f s, slowest of %d %.2f s\n", 100 * loss, 1e3 * delay,
                500 * delay, took_s[kRuns / 2], kRuns, took_s.back());
  }
}

TEST(Handshake, FreshKeysEachTime) {
  Pair first({}), second({});
  ASSERT_TRUE(first.both_agree(kSecond) && second.both_agree(kSecond));
  EXPECT_FALSE(share_keys(*first.dialer.sessions[0], *second.listener.sessions[0]));
}

TEST(Handshake, TheWrongKeyNeverGetsASession) {
  Pair pair({.delay_s = 0.01}, 1, kOtherKey);
  pair.network.run(30 * kSecond);
  EXPECT_TRUE(pair.dialer.sessions.empty() && pair.listener.sessions.empty());
  EXPECT_EQ(pair.listener.count(Kind::kAgreed), 0);
  ASSERT_FALSE(pair.dialer.events.empty());
  EXPECT_NE(pair.dialer.events[0].why.find("unknown psk identity"), std::string::npos) << pair.dialer.events[0].why;
}

TEST(Handshake, APeerThatDoesNotFitIsRefusedOnBothSidesByASentence) {
  Greeting version = patient(), role = patient(), joints = patient(), units = patient(), configuration = patient();
  version.version = kProtocolVersion + 1;
  role.role = Role::kLeader;
  joints.joints = 2;
  units.units = "deg, deg/s, N m, ns";
  configuration.configuration = "fedcba9876543210";
  const std::pair<Greeting, const char*> cases[] = {{version, "version"},
                                                    {role, "role"},
                                                    {joints, "degrees of freedom"},
                                                    {units, "units"},
                                                    {configuration, "configuration"}};
  for (const auto& [greeting, names] : cases) {
    Pair pair({.delay_s = 0.05, .loss = 0.3}, 3, kKey, greeting);
    ASSERT_TRUE(pair.network.run_until(
        [&] { return pair.dialer.count(Kind::kRefused) > 0 && pair.listener.count(Kind::kRefused) > 0; },
        60 * kSecond));
    for (const Party* party : {&pair.dialer, &pair.listener}) {
      const auto refused = std::find_if(party->events.begin(), party->events.end(),
                                        [](const HandshakeEvent& e) { return e.kind == Kind::kRefused; });
      EXPECT_TRUE(refused->why.starts_with(names)) << refused->why;
      EXPECT_TRUE(party->sessions.empty());
    }
    std::printf("%s\n", pair.dialer.events.back().why.c_str());
  }
}

TEST(Handshake, TheDialerCallsAgainOnceItsSessionIsGivenBack) {
  Pair pair({.delay_s = 0.02});
  ASSERT_TRUE(pair.both_agree(kSecond));
  pair.network.run(kSecond);
  const int sent = pair.dialer.sent;
  pair.network.run(20 * kSecond);
  EXPECT_EQ(pair.dialer.sent, sent) << "nothing to say while a session is in use";
  EXPECT_EQ(pair.dialer.sessions.size(), 1u);
  pair.dialer.handshaker->give_back(std::move(pair.dialer.sessions[0]), pair.network.now());
  ASSERT_TRUE(pair.network.run_until([&] { return pair.listener.sessions.size() == 2; }, kSecond));
  pair.network.run(kSecond);
  ASSERT_EQ(pair.dialer.sessions.size(), 2u);
  EXPECT_TRUE(share_keys(*pair.dialer.sessions[1], *pair.listener.sessions[1]));
}

TEST(Handshake, ARestartedBoxAndOneBehindANewAddressGetASession) {
  Pair pair({.delay_s = 0.02});
  ASSERT_TRUE(pair.both_agree(kSecond));
  Party& rebound = pair.network.add(Handshaker::dialer(kKey, patient(), kListenerAt), endpoint(1001));
  ASSERT_TRUE(pair.network.run_until([&] { return pair.listener.sessions.size() == 2; }, kSecond));
  EXPECT_TRUE(share_keys(*rebound.sessions[0], *pair.listener.sessions[1]));
  pair.dialer.handshaker = Handshaker::dialer(kKey, patient(), kListenerAt);  // the same address, from the start
  ASSERT_TRUE(pair.network.run_until([&] { return pair.listener.sessions.size() == 3; }, kSecond));
  EXPECT_TRUE(share_keys(*pair.dialer.sessions[1], *pair.listener.sessions[2]));
}

TEST(Handshake, ASlowOneIsGivenUpAndCostsNothing) {
  HandshakeNetwork network({}, 1);
  Party& listener = network.add(Handshaker::listener(kKey, therapist()), kListenerAt);
  // Callers that obtain a place and never go on.
  for (std::uint16_t port = 1; port <= 100; ++port) {
    Party& slow = network.add(Handshaker::dialer(kOtherKey, patient(), kListenerAt), endpoint(port));
    static_cast<void>(slow);
  }
  int words = 0;
  network.on_path = [&](const UdpEndpoint& from, HandshakeDatagram&) { return from == kListenerAt || ++words <= 200; };
  network.run(5 * kSecond);
  network.on_path = nullptr;
  Party& box = network.add(Handshaker::dialer(kKey, patient(), kListenerAt), kDialerAt);
  EXPECT_TRUE(network.run_until([&] { return !box.sessions.empty() && !listener.sessions.empty(); }, 30 * kSecond));
}

TEST(Handshake, AForeignSenderGetsNoMoreThanItSends) {
  // Forged senders: a hello is answered by a shorter cookie, and nothing is kept.
  HandshakeNetwork network({}, 1);
  Party& listener = network.add(Handshaker::listener(kKey, therapist()), kListenerAt);
  DtlsContext context(LinkEnd::kDialer, kKey);
  Dtls dtls(context);
  dtls.step();
  const Bytes hello = dtls.take_written().at(0);
  std::size_t answered = 0;
  network.on_path = [&](const UdpEndpoint&, HandshakeDatagram& datagram) {
    answered += datagram.size;
    return false;
  };
  for (std::uint16_t port = 1; port <= 10'000; ++port) network.inject(endpoint(port), kListenerAt, hello);
  network.run(kSecond);
  EXPECT_EQ(listener.sent, 10'000);
  EXPECT_LT(answered, hello.size() * 10'000);
  network.on_path = nullptr;
  Party& box = network.add(Handshaker::dialer(kKey, patient(), kListenerAt), kDialerAt);
  EXPECT_TRUE(network.run_until([&] { return !box.sessions.empty(); }, kSecond)) << "the right one is served at once";
}

TEST(Handshake, NoiseAndRepetitionInjectedOnThePathLeadToNoSession) {
  Pair pair({.delay_s = 0.01});
  std::vector<std::pair<UdpEndpoint, Bytes>> seen;
  std::mt19937_64 bits(5);
  pair.network.on_path = [&](const UdpEndpoint& from, HandshakeDatagram& datagram) {
    seen.emplace_back(from, Bytes(datagram.view().begin(), datagram.view().end()));
    return true;
  };
  ASSERT_TRUE(pair.both_agree(kSecond));
  pair.network.on_path = nullptr;
  const std::size_t sessions = pair.listener.sessions.size();
  // Everything of the whole handshake again, from its own and from other addresses, and mutations of it.
  for (int i = 0; i < 20'000; ++i) {
    auto [from, bytes] = seen[bits() % seen.size()];
    for (std::uint64_t flips = bits() % 4; flips > 0; --flips)
      bytes[bits() % bytes.size()] ^= static_cast<std::byte>(bits());
    if (bits() % 8 == 0) bytes.resize(bits() % bytes.size());
    const UdpEndpoint to = from == kListenerAt ? kDialerAt : kListenerAt;
    pair.network.inject(bits() % 2 == 0 ? from : endpoint(static_cast<std::uint16_t>(bits() % 5)), to, bytes,
                        static_cast<Nanoseconds>(bits() % 1000) * kMillisecond);
  }
  pair.network.run(5 * kSecond);
  EXPECT_EQ(pair.listener.sessions.size(), sessions);
  EXPECT_EQ(pair.dialer.sessions.size(), 1u);
  EXPECT_EQ(pair.listener.count(Kind::kAgreed) + pair.listener.count(Kind::kRefused), 1);
}

TEST(Handshake, DamageOnThePathDelaysItAndNoMore) {
  int agreed = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Pair pair({.delay_s = 0.01}, seed);
    std::mt19937_64 bits(seed);
    pair.network.on_path = [&](const UdpEndpoint&, HandshakeDatagram& datagram) {
      if (bits() % 3 == 0) datagram.bytes[bits() % datagram.size] ^= static_cast<std::byte>(1u << bits() % 8);
      return true;
    };
    pair.network.run(20 * kSecond);
    if (pair.both_agree(kMillisecond)) ++agreed;
  }
  std::printf("%d of 50 agreed with every third datagram damaged\n", agreed);
  EXPECT_GT(agreed, 0);
}

// Keys in files.

std::string problem_with(const std::filesystem::path& file) {
  try {
    load_key(file);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(PairingKey, IsStoredForItsOwnerAloneAndReadBack) {
  ScratchDirectory scratch;
  const auto file = scratch / "new/directory/key";
  const mode_t mask = umask(0);
  store_key(file, kKey, ExistingKey::kRefuse);
  umask(mask);
  struct stat info {};
  ASSERT_EQ(::stat(file.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 07777, 0600u);
  EXPECT_EQ(file_bytes(file), std::string(63, '3') + "7\n");
  EXPECT_EQ(load_key(file), kKey);
  EXPECT_THROW(store_key(file, kOtherKey, ExistingKey::kRefuse), std::runtime_error);
  EXPECT_EQ(load_key(file), kKey);
  store_key(file, kOtherKey, ExistingKey::kReplace);
  EXPECT_EQ(load_key(file), kOtherKey);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file.parent_path()), {}), 1)
      << "nothing is left beside it";
  revoke_key(file);
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_NE(problem_with(file).find("does not exist"), std::string::npos);
}

TEST(PairingKey, IsRefusedWhenOthersMayKnowItOrItIsNone) {
  ScratchDirectory scratch;
  const auto file = scratch / "key";
  store_key(file, kKey, ExistingKey::kRefuse);
  for (const unsigned mode : {0640u, 0604u, 0660u, 0400u, 0700u, 0666u, 04600u}) {
    ASSERT_EQ(::chmod(file.c_str(), mode), 0);
    EXPECT_NE(problem_with(file).find("has mode 0"), std::string::npos) << mode;
    EXPECT_NE(problem_with(file).find(file.string()), std::string::npos);
  }
  ASSERT_EQ(::chmod(file.c_str(), 0600), 0);
  EXPECT_EQ(problem_with(file), "");
  if (::geteuid() == 0) {
    ASSERT_EQ(::chown(file.c_str(), 12345, 0), 0);
    EXPECT_NE(problem_with(file).find("belongs to user 12345"), std::string::npos);
    ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  }
  std::filesystem::create_symlink(file, scratch / "link");
  EXPECT_NE(problem_with(scratch / "link").find("symbolic link"), std::string::npos);
  EXPECT_NE(problem_with(scratch.path()).find("not a regular file"), std::string::npos);
  const std::pair<std::string, const char*> contents[] = {{"", "this has 0 characters"},
                                                          {std::string(63, 'a'), "this has 63 characters"},
                                                          {std::string(65, 'a'), "this has 65 characters"},
                                                          {std::string(4096, 'a'), "characters"},
                                                          {std::string(63, 'a') + "g", "hexadecimal digits only"}};
  for (const auto& [text, says] : contents) {
    write_bytes(file, text);
    EXPECT_NE(problem_with(file).find(says), std::string::npos) << problem_with(file);
    EXPECT_THROW(revoke_key(file), std::runtime_error) << "it removes keys only";
  }
}

TEST(PairingKey, HasAPhraseThatAnyDifferenceChanges) {
  const std::string phrase = kKey.check_phrase();
  std::printf("%s, %s\n", kKey.identity().c_str(), phrase.c_str());
  EXPECT_EQ(phrase.size(), 4 * 5 + 3u);
  EXPECT_EQ(PairingKey::from_text(" " + std::string(63, '3') + "7\r\n").check_phrase(), phrase);
  std::vector<std::string> phrases, identities;
  for (std::size_t bit = 0; bit < 8 * PairingKey::kBytes; ++bit) {
    PairingKey::Bytes bytes = kKey.bytes();
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    phrases.push_back(PairingKey(bytes).check_phrase());
    identities.push_back(PairingKey(bytes).identity());
  }
  for (auto* all : {&phrases, &identities}) {
    std::sort(all->begin(), all->end());
    EXPECT_EQ(std::unique(all->begin(), all->end()), all->end());
  }
  EXPECT_FALSE(std::binary_search(phrases.begin(), phrases.end(), phrase));
  EXPECT_FALSE(PairingKey::random() == PairingKey::random());
}

}  // namespace
}  // namespace farhand
