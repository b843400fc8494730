// Packets under the seal, and the channel that decides whose are opened: what is authentic always passes, once, and
// nothing else ever does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <queue>

#include "common/link/codec.hpp"
#include "common/secure/secure_channel.hpp"
#include "netem/lab/sealed_pair.hpp"
#include "netem/link_model.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using Opening = MediaSession::Opening;
using Incoming = SecureChannel::Incoming;
using Datagram = std::vector<std::byte>;

Datagram copy_of(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

Datagram packet_number(std::uint32_t number) {
  Datagram packet(PacketCodec<1>::kSize);
  std::memcpy(packet.data(), &number, sizeof number);
  return packet;
}

Opening open_copy(MediaSession& session, Datagram datagram) {
  std::span<std::byte> packet;
  return session.open(datagram, packet);
}

TEST(SealedPackets, ComeOutAsTheyWentInAndAreLongerByTheOverheadOnly) {
  SealedPair pair(1);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, PacketCodec<1>::kSize, PacketCodec<2>::kSize,
                                 MediaSession::kLargestDatagram - MediaSession::kOverhead}) {
    Datagram packet(size);
    for (std::size_t i = 0; i < size; ++i) packet[i] = static_cast<std::byte>(i * 7);
    for (const bool dialer : {false, true}) {
      Datagram sealed = copy_of((dialer ? pair.dialer : pair.listener)->seal(packet));
      ASSERT_EQ(sealed.size(), size + MediaSession::kOverhead);
      std::span<std::byte> opened;
      ASSERT_EQ((dialer ? pair.listener : pair.dialer)->open(sealed, opened), Opening::kOpened);
      EXPECT_TRUE(std::equal(opened.begin(), opened.end(), packet.begin(), packet.end()));
    }
  }
  EXPECT_TRUE(pair.dialer->seal(Datagram(MediaSession::kLargestDatagram)).empty());
}

TEST(SealedPackets, ShowNoFieldOfThePacket) {
  SealedPair pair(2);
  PacketCodec<1> codec;
  Packet<1> packet{.session = 0xA1B2C3D4,
                   .seq = 0x11223344,
                   .send_time_ns = 0x1122334455667788,
                   .echo_session = 0xB1C2D3E4,
                   .echo_seq = 0x21324354,
                   .echo_send_time_ns = 0x2132435465768798,
                   .echo_dwell_ns = 0x31425364,
                   .expiry_ms = 0x41526374,
                   .state = StationState::kEngaged,
                   .limits = kLimitRate,
                   .motion = {}};
  packet.motion.x.setConstant(0.123456789);
  packet.motion.v.setConstant(-1.23456789);
  packet.motion.f.setConstant(2.3456789);
  for (int i = 0; i < 1000; ++i) {
    const auto plain = codec.encode(packet);
    const auto sealed = pair.dialer->seal(plain).subspan(12);  // the header counts packets and says nothing else
    // Four equal bytes in a row, anywhere: 96 * 115 / 2^32 by chance, 3e-3 over all of this, and the keys are fixed.
    for (std::size_t at = 0; at + 4 <= plain.size(); ++at) {
      const auto part = plain.subspan(at, 4);
      if (std::all_of(part.begin(), part.end(), [](std::byte b) { return b == std::byte{0}; })) continue;
      EXPECT_EQ(std::search(sealed.begin(), sealed.end(), part.begin(), part.end()), sealed.end()) << at;
    }
  }
}

TEST(SealedPackets, TouchNeitherHeapNorMutex) {
  if (kCounterIsBlind) GTEST_SKIP() << "nothing can be counted under a sanitizer";
  SealedPair pair(3);
  const Datagram packet(PacketCodec<1>::kSize);
  std::array<std::byte, MediaSession::kLargestDatagram> buffer;
  std::uint64_t opened = 0;
  const TouchCounter counter;
  for (int i = 0; i < 100'000; ++i) {
    const auto sealed = pair.dialer->seal(packet);
    std::copy(sealed.begin(), sealed.end(), buffer.begin());
    if (i % 10 == 0) buffer[40] ^= std::byte{1};  // refused ones cost no more
    std::span<std::byte> out;
    if (pair.listener->open(std::span(buffer).first(sealed.size()), out) == Opening::kOpened) ++opened;
  }
  EXPECT_EQ(counter.since(), Touched{});
  EXPECT_EQ(opened, 90'000u);
}

TEST(SealedPackets, OfAWildNetworkAreAllTakenOnceAndNoReplayIs) {
  SealedPair pair(4);
  LinkModel link({.delay_s = 0.5, .jitter_s = 0.25}, 4, LinkDirection::kForward);
  constexpr std::uint32_t kPackets = 100'000;  // 100 s: over the wrap of the 16-bit number
  using Arrival = std::pair<Nanoseconds, Datagram>;
  const auto later = [](const Arrival& a, const Arrival& b) { return a.first > b.first; };
  std::priority_queue<Arrival, std::vector<Arrival>, decltype(later)> on_way(later);
  std::mt19937_64 bits(4);
  std::vector<int> taken(kPackets);
  std::uint64_t replays_taken = 0, reordered = 0;
  std::vector<Datagram> heard;
  std::uint32_t newest = 0;
  const auto deliver_until = [&](Nanoseconds now) {
    while (!on_way.empty() && on_way.top().first <= now) {
      Datagram datagram = on_way.top().second;
      on_way.pop();
      heard.push_back(datagram);
      std::span<std::byte> packet;
      if (pair.listener->open(datagram, packet) == Opening::kOpened) {
        std::uint32_t number = 0;
        std::memcpy(&number, packet.data(), sizeof number);
        ++taken[number];
        if (number < newest) ++reordered;
        newest = std::max(newest, number);
      }
      // The same again at once, and any older one.
      if (open_copy(*pair.listener, heard.back()) == Opening::kOpened) ++replays_taken;
      if (open_copy(*pair.listener, heard[bits() % heard.size()]) == Opening::kOpened) ++replays_taken;
    }
  };
  for (std::uint32_t i = 0; i < kPackets; ++i) {
    const Nanoseconds now = Nanoseconds{i} * kMillisecond;
    on_way.emplace(now + link.offer(now).delay, copy_of(pair.dialer->seal(packet_number(i))));
    deliver_until(now);
  }
  deliver_until(Nanoseconds{kPackets} * kMillisecond + kSecond);
  for (const Datagram& datagram : heard) {
    if (open_copy(*pair.listener, datagram) == Opening::kOpened) ++replays_taken;
  }
  std::printf("%llu of %u came after a newer one\n", static_cast<unsigned long long>(reordered), kPackets);
  EXPECT_GT(reordered, kPackets / 2);
  EXPECT_EQ(std::count(taken.begin(), taken.end(), 1), std::ptrdiff_t{kPackets}) << "every authentic one, once";
  EXPECT_EQ(replays_taken, 0u);
}

TEST(SealedPackets, AreOpenedAfterAnOutageOfThirtyThousand) {
  SealedPair pair(5);
  std::uint32_t number = 0;
  for (int outage = 0; outage < 20; ++outage) {
    for (int lost = 0; lost < 30'000; ++lost) pair.dialer->seal(packet_number(number++));
    EXPECT_EQ(open_copy(*pair.listener, copy_of(pair.dialer->seal(packet_number(number++)))), Opening::kOpened);
  }
}

// Everything that one can do to a datagram without the key.
class Forger {
 public:
  explicit Forger(std::uint64_t seed) : bits_(seed), foreign_(seed + 1) {
    for (std::uint32_t i = 0; i < 64; ++i) foreign_sealed_.push_back(copy_of(foreign_.dialer->seal(packet_number(i))));
  }

  Datagram forge(const Datagram& authentic) {
    Datagram d = authentic;
    switch (bits_() % 8) {
      case 0: {  // one bit
        const std::uint64_t bit = bits_() % (8 * d.size());
        d[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
        return d;
      }
      case 1:  // a few bytes
        for (std::uint64_t n = 1 + bits_() % 8; n > 0; --n) any_of(d) ^= static_cast<std::byte>(1 + bits_() % 255);
        return d != authentic ? d : forge(authentic);
      case 2:  // cut
        d.resize(bits_() % d.size());
        return d;
      case 3:  // longer
        for (std::uint64_t n = 1 + bits_() % 32; n > 0; --n) d.push_back(random_byte());
        return d;
      case 4:  // another packet number
        d[2 + bits_() % 2] ^= static_cast<std::byte>(1 + bits_() % 255);
        return d;
      case 5:  // the right header and noise
        for (std::size_t i = 12; i < d.size(); ++i) d[i] = random_byte();
        return d;
      case 6:  // noise
        for (std::byte& b : d) b = random_byte();
        return d;
      default:  // authentic in another session
        return foreign_sealed_[bits_() % foreign_sealed_.size()];
    }
  }

 private:
  std::byte random_byte() { return static_cast<std::byte>(bits_()); }
  std::byte& any_of(Datagram& d) { return d[bits_() % d.size()]; }

  std::mt19937_64 bits_;
  SealedPair foreign_;
  std::vector<Datagram> foreign_sealed_;
};

void expect_no_forgery_taken(std::uint64_t count, std::uint64_t seed) {
  SealedPair pair(seed);
  Forger forger(seed);
  std::uint64_t taken = 0;
  Datagram authentic;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (i % 100 == 0) authentic = copy_of(pair.dialer->seal(packet_number(static_cast<std::uint32_t>(i))));
    if (open_copy(*pair.listener, forger.forge(authentic)) == Opening::kOpened) ++taken;
    if (i % 100 == 99) {
      ASSERT_EQ(open_copy(*pair.listener, authentic), Opening::kOpened)
          << "forgeries do not block what they were made of";
    }
  }
  std::printf("%llu forged or mutated, %llu taken\n", static_cast<unsigned long long>(count),
              static_cast<unsigned long long>(taken));
  EXPECT_EQ(taken, 0u);
}

TEST(SealedPackets, ForgedOrMutatedAreNeverTaken) { expect_no_forgery_taken(500'000, 6); }
TEST(NightlySealedPackets, TenMillionForgedOrMutatedAreNeverTaken) { expect_no_forgery_taken(10'000'000, 7); }

TEST(SealedPackets, EveryFlippedBitAndEveryTruncationIsRefused) {
  SealedPair pair(8);
  const Datagram authentic = copy_of(pair.dialer->seal(packet_number(1)));
  for (std::size_t bit = 0; bit < 8 * authentic.size(); ++bit) {
    Datagram d = authentic;
    d[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    EXPECT_NE(open_copy(*pair.listener, d), Opening::kOpened) << bit;
  }
  for (std::size_t size = 0; size < authentic.size(); ++size) {
    EXPECT_NE(
        open_copy(*pair.listener, Datagram(authentic.begin(), authentic.begin() + static_cast<std::ptrdiff_t>(size))),
        Opening::kOpened);
  }
  EXPECT_NE(open_copy(*pair.dialer, authentic), Opening::kOpened) << "its own packet, sent back";
  EXPECT_EQ(open_copy(*pair.listener, authentic), Opening::kOpened);
}

// The channel: whose packets are opened, and whom the answers go to.

const UdpEndpoint kBox = endpoint(1000), kElsewhere = endpoint(1001);

Incoming arrive(SecureChannel& channel, Datagram datagram, const UdpEndpoint& from, Nanoseconds now) {
  std::span<std::byte> packet;
  return channel.open(datagram, from, now, packet);
}

Datagram from_box(SealedPair& pair) { return copy_of(pair.dialer->seal(packet_number(0))); }

// A listener with a session in force.
struct Running {
  SealedPair pair{11, kBox};
  SecureChannel channel{LinkEnd::kListener};
  Nanoseconds now = kSecond;

  Running() {
    channel.offer(std::move(pair.listener), now);
    EXPECT_FALSE(channel.in_force()) << "a handshake alone is not enough";
    EXPECT_EQ(arrive(channel, from_box(pair), kBox, now), Incoming::kPacket);
    EXPECT_TRUE(channel.in_force());
  }
};

TEST(SecureChannel, OpensAndSealsNothingBeforeASession) {
  SecureChannel channel(LinkEnd::kListener);
  SealedPair pair(12);
  EXPECT_EQ(arrive(channel, from_box(pair), kBox, 0), Incoming::kRejected);
  EXPECT_EQ(arrive(channel, {}, kBox, 0), Incoming::kRejected);
  EXPECT_TRUE(channel.seal(packet_number(0)).empty());
  EXPECT_EQ(channel.counters().no_session, 2u);
  for (int first = 0; first < 256; ++first) {
    const bool dtls = first >= 20 && first <= 63;
    EXPECT_EQ(arrive(channel, {static_cast<std::byte>(first)}, kBox, 0),
              dtls ? Incoming::kHandshake : Incoming::kRejected);
  }
}

TEST(SecureChannel, ARestartedBoxTakesOverWithItsFirstAuthenticPacketOnly) {
  Running running;
  SealedPair restarted(13, kElsewhere);
  EXPECT_EQ(running.channel.offer(std::move(restarted.listener), running.now), nullptr);
  EXPECT_EQ(running.channel.peer(), kBox);
  EXPECT_EQ(arrive(running.channel, from_box(running.pair), kBox, running.now), Incoming::kPacket)
      << "goes on meanwhile";

  Datagram forged = from_box(restarted);
  forged[50] ^= std::byte{1};
  EXPECT_EQ(arrive(running.channel, forged, kElsewhere, running.now), Incoming::kRejected);
  EXPECT_EQ(running.channel.peer(), kBox);
  EXPECT_EQ(arrive(running.channel, from_box(restarted), kElsewhere, running.now), Incoming::kPacket);
  EXPECT_EQ(running.channel.peer(), kElsewhere);
  EXPECT_NE(running.channel.retire(running.now), nullptr) << "the old one goes back";
  EXPECT_EQ(running.channel.retire(running.now), nullptr);
  EXPECT_EQ(arrive(running.channel, from_box(running.pair), kBox, running.now), Incoming::kRejected) << "and is over";
}

TEST(SecureChannel, ARestartBehindTheSameAddressTakesOverToo) {
  Running running;
  SealedPair restarted(14, kBox);
  running.channel.offer(std::move(restarted.listener), running.now);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(arrive(running.channel, from_box(running.pair), kBox, running.now), Incoming::kPacket);
  }
  EXPECT_EQ(arrive(running.channel, from_box(restarted), kBox, running.now), Incoming::kPacket);
  EXPECT_EQ(arrive(running.channel, from_box(running.pair), kBox, running.now), Incoming::kRejected);
  EXPECT_EQ(running.channel.counters().sessions, 2u);
  EXPECT_EQ(running.channel.counters().forged, 1u) << "only what no session could open counts as forged";
}

TEST(SecureChannel, ASessionThatOnlyShookHandsIsForgottenAfterFiveSeconds) {
  Running running;
  SealedPair idle(15, kElsewhere);
  running.channel.offer(std::move(idle.listener), running.now);
  const Nanoseconds end = running.now + SecureChannel::kSilence;
  for (; running.now < end; running.now += kMillisecond) {
    ASSERT_EQ(running.channel.retire(running.now), nullptr);
    ASSERT_EQ(arrive(running.channel, from_box(running.pair), kBox, running.now), Incoming::kPacket);
  }
  EXPECT_NE(running.channel.retire(running.now), nullptr);
  EXPECT_EQ(running.channel.peer(), kBox);
  EXPECT_EQ(arrive(running.channel, from_box(idle), kElsewhere, running.now), Incoming::kRejected);
}

TEST(SecureChannel, AnAuthenticPacketFromAnotherAddressNeitherMovesTheAnswersNorCounts) {
  Running running;
  EXPECT_EQ(arrive(running.channel, from_box(running.pair), kElsewhere, running.now), Incoming::kRejected);
  EXPECT_EQ(running.channel.peer(), kBox);
  EXPECT_EQ(running.channel.counters().foreign, 1u);
}

TEST(SecureChannel, FiveSecondsOfSilenceEndASessionForGood) {
  for (const LinkEnd end : {LinkEnd::kDialer, LinkEnd::kListener}) {
    SealedPair pair(16);
    SecureChannel channel(end);
    MediaSession& peer = end == LinkEnd::kDialer ? *pair.listener : *pair.dialer;
    const UdpEndpoint at = (end == LinkEnd::kDialer ? pair.dialer : pair.listener)->peer();
    channel.offer(std::move(end == LinkEnd::kDialer ? pair.dialer : pair.listener), 0);
    ASSERT_EQ(arrive(channel, copy_of(peer.seal(packet_number(0))), at, kSecond), Incoming::kPacket);
    // Forgeries, replays and handshakes are no sign of life.
    const Datagram replayed = copy_of(peer.seal(packet_number(1)));
    ASSERT_EQ(arrive(channel, replayed, at, kSecond), Incoming::kPacket);
    const Nanoseconds over = kSecond + SecureChannel::kSilence;
    EXPECT_EQ(arrive(channel, replayed, at, over - 2), Incoming::kRejected);
    EXPECT_EQ(arrive(channel, Datagram(127, std::byte{0x80}), at, over - 2), Incoming::kRejected);
    EXPECT_EQ(arrive(channel, Datagram(127, std::byte{22}), at, over - 2), Incoming::kHandshake);
    EXPECT_EQ(channel.retire(over - 1), nullptr);
    EXPECT_FALSE(channel.seal(packet_number(0)).empty());
    EXPECT_NE(channel.retire(over), nullptr);
    EXPECT_TRUE(channel.seal(packet_number(0)).empty());
    EXPECT_EQ(arrive(channel, copy_of(peer.seal(packet_number(2))), at, over), Incoming::kRejected)
        << "a late authentic packet of it as well";
  }
}

TEST(SecureChannel, ADialerSpeaksFirst) {
  SealedPair pair(17);
  SecureChannel dialer(LinkEnd::kDialer), listener(LinkEnd::kListener);
  listener.offer(std::move(pair.listener), 0);
  EXPECT_TRUE(listener.seal(packet_number(0)).empty());
  dialer.offer(std::move(pair.dialer), 0);
  EXPECT_EQ(arrive(listener, copy_of(dialer.seal(packet_number(0))), kBox, 0), Incoming::kPacket);
  EXPECT_EQ(arrive(dialer, copy_of(listener.seal(packet_number(0))), endpoint(2000), 0), Incoming::kPacket);
}

TEST(SecureChannel, AFloodFromForeignAddressesChangesNothing) {
  Running running;
  Forger forger(18);
  std::mt19937_64 bits(18);
  for (int i = 0; i < 100'000; ++i) {
    const Datagram authentic = from_box(running.pair);
    arrive(running.channel, forger.forge(authentic), bits() % 2 == 0 ? kBox : kElsewhere, running.now);
    ASSERT_EQ(arrive(running.channel, authentic, kBox, running.now), Incoming::kPacket);
    running.now += kMillisecond;
  }
  EXPECT_EQ(running.channel.peer(), kBox);
  EXPECT_EQ(running.channel.counters().opened, 100'001u);
}

}  // namespace
}  // namespace farhand
