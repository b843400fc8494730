// What someone on the network can try, in virtual time, between a box and a station that have met. Where each attack is
// tried, and what is asserted:
//
//   replay ........................ none is taken twice ........ SealedPackets.OfAWildNetworkAreAllTakenOnce...
//   replay of another session ..... none is taken .............. Attack.PacketsOfAnEndedSessionAreNothingToTheNext
//   reorder ....................... each once, in order ........ SealedPackets.OfAWildNetworkAreAllTakenOnce...
//   delay beyond expiry ........... opened, never acted upon ... Attack.PacketsHeldBackAreOpenedAndNeverActedUpon
//   delay that creeps ............. ends at the expiry too ..... Attack.ADelayThatCreepsEndsAtTheExpiry
//   bit flips, truncation ......... every one refused .......... SealedPackets.EveryFlippedBitAndEveryTruncation...
//   forgeries ..................... none of 1e7 is taken ....... NightlySealedPackets.TenMillionForgedOrMutated...
//   flood, tenfold ................ each authentic one is taken  Attack.AFloodOfTenForeignDatagramsForEach...
//   flood at a tick ............... its share is bounded ....... Flood.ThatNeverRunsDryGetsABoundedShareOfATick
//   flood of long datagrams ....... the tick reads on .......... UdpSocket.LongDatagramsDoNotHideThoseBehindThem
//   hellos of many ports .......... the right box gets in ...... CrowdedLink.PortsOfOneHostDoNotKeepTheRight...
//   foreign sender ................ answers stay where they go . SecureChannel.AnAuthenticPacketFromAnotherAddress...
//   reflection .................... refused .................... SealedPackets.EveryFlippedBitAndEveryTruncation...
//   wrong key ..................... no session ................. Handshake.TheWrongKeyNeverGetsASession
//   downgrade to plain ............ a plain packet is none ..... Attack.APlainPacketWithItsChecksumIsNoPacket
//   downgrade of the handshake .... no session, or the strong .. Attack.AHelloChangedOnThePathLeadsToNoWeaker...
//   weaker suite, version, no SRTP  refused .................... OpenSslClient.IsRefusedWithAnythingWeaker
//   other version, role, units .... refused by a sentence ...... Handshake.APeerThatDoesNotFitIsRefused...
//   slow handshake ................ memory bounded, box served . Attack.HalfOpenHandshakesKeepNoMemoryAnd...
//   byte by byte .................. memory bounded, box served . Attack.AHandshakeOneByteAtATimeIsGivenUp
//   alerts, hellos in mid-session . nothing changes ............ Attack.ForgedAlertsAndHellosInMidSession...
//   takeover without the key ...... nothing changes ............ SecureChannel.ARestartedBoxTakesOver...
//   a second holder of the key .... takes over by first packet . Attack.ASecondHolderOfTheKeyTakesOverWhole
//   NAT rebinding, a restart ...... taken over within a second . Handshake.ARestartedBoxAndOneBehindANew...
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>

#include "common/link/codec.hpp"
#include "common/link/receiver.hpp"
#include "common/secure/dtls.hpp"
#include "common/secure/secure_channel.hpp"
#include "tests/support/handshake_network.hpp"

namespace farhand {
namespace {

using Kind = HandshakeEvent::Kind;
using Incoming = SecureChannel::Incoming;
using Party = HandshakeNetwork::Party;

const PairingKey kKey = PairingKey::from_text(std::string(63, '4') + "7");
const PairingKey kOtherKey = PairingKey::from_text(std::string(63, '4') + "8");
const UdpEndpoint kElsewhere = endpoint(1001);

Greeting greeting_of(Role role) { return {.role = role, .configuration = "0123456789abcdef", .program = "1.2.3"}; }
std::unique_ptr<Handshaker> box(const PairingKey& key = kKey) {
  return Handshaker::dialer(key, greeting_of(Role::kFollower), kListenerAt);
}
std::unique_ptr<Handshaker> station() { return Handshaker::listener(kKey, greeting_of(Role::kLeader)); }

Bytes copy_of(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

Bytes packet_of(std::uint32_t seq, Nanoseconds sent) {
  static PacketCodec<1> codec;
  Packet<1> packet{.session = 1, .seq = seq, .send_time_ns = sent, .state = StationState::kEngaged, .motion = {}};
  packet.motion.x.setConstant(seq);
  return copy_of(codec.encode(packet));
}

// A box and a station that have met, each with its channel.
struct Session {
  HandshakeNetwork network{LinkModelParams{.delay_s = 0.01}, 1};
  Party& dialer = network.add(box(), kDialerAt);
  Party& listener = network.add(station(), kListenerAt);
  SecureChannel from_box{LinkEnd::kDialer}, to_station{LinkEnd::kListener};
  std::uint32_t seq = 0;

  Session() { meet(); }

  void meet() {
    EXPECT_TRUE(network.run_until([&] { return !dialer.sessions.empty() && !listener.sessions.empty(); }, kSecond));
    network.run(kSecond / 10);
    from_box.offer(take(dialer), network.now());
    to_station.offer(take(listener), network.now());
    EXPECT_EQ(send(), Incoming::kPacket);
  }
  static std::unique_ptr<MediaSession> take(Party& party) {
    auto session = std::move(party.sessions.back());
    party.sessions.pop_back();
    return session;
  }
  Bytes seal() {
    ++seq;
    return copy_of(from_box.seal(packet_of(seq, network.now())));
  }
  Incoming arrive(Bytes datagram, const UdpEndpoint& from = kDialerAt) {
    std::span<std::byte> packet;
    return to_station.open(datagram, from, network.now(), packet);
  }
  Incoming send() { return arrive(seal()); }
};

TEST(Attack, PacketsOfAnEndedSessionAreNothingToTheNext) {
  Session session;
  std::vector<Bytes> heard;
  for (int i = 0; i < 1000; ++i) {
    heard.push_back(session.seal());
    if (i % 2 == 0) session.arrive(heard.back());  // half of them are new to the station
  }
  session.dialer.handshaker->give_back(nullptr, session.network.now());
  session.meet();
  for (const Bytes& datagram : heard) ASSERT_EQ(session.arrive(datagram), Incoming::kRejected);
  EXPECT_EQ(session.send(), Incoming::kPacket);
  EXPECT_EQ(session.to_station.counters().opened, 3 + 500u);
}

// The network as an attacker has it: every packet comes, whole, when he likes.
struct Delayed {
  Session session;
  Receiver<1> receiver{{.timeout = 100 * kMillisecond, .playout_max = 200 * kMillisecond, .expiry = kSecond / 2}, 2};
  PacketCodec<1> codec;
  Receipt last = Receipt::kAccepted;

  // Sent at `sent`, there at `arrival`.
  void deliver(const Bytes& sealed, Nanoseconds arrival) {
    Bytes datagram = sealed;
    std::span<std::byte> plain;
    ASSERT_EQ(session.to_station.open(datagram, kDialerAt, arrival, plain), Incoming::kPacket) << "it is authentic";
    Packet<1> packet;
    ASSERT_EQ(codec.decode(plain, packet), DecodeResult::kOk);
    last = receiver.accept(packet, arrival);
  }
  Bytes sealed_at(Nanoseconds sent) { return copy_of(session.from_box.seal(packet_of(++session.seq, sent))); }
};

TEST(Attack, PacketsHeldBackAreOpenedAndNeverActedUpon) {
  Delayed d;
  for (int i = 0; i < 3000; ++i) {
    const Nanoseconds now = kSecond + i * kMillisecond;
    d.deliver(d.sealed_at(now - 20 * kMillisecond), now);
    d.receiver.play(now);
  }
  // From now on all are held back, and come 600 ms late at their own pace.
  const Nanoseconds cut = 4 * kSecond;
  const Played<1> before = d.receiver.play(cut);
  for (int i = 0; i < 2000; ++i) {
    const Nanoseconds sent = cut - 20 * kMillisecond + i * kMillisecond, now = sent + 620 * kMillisecond;
    d.deliver(d.sealed_at(sent), now);
    ASSERT_EQ(d.last, Receipt::kExpired) << i;
    ASSERT_FALSE(d.receiver.alive(now)) << "silence, for all that the station knows";
    ASSERT_LE(d.receiver.play(now).content_time, before.content_time + 20 * kMillisecond);
  }
  EXPECT_EQ(d.receiver.counters().rejected_expired, 2000u);
}

// The fastest packet seen may seem to get slower only as fast as two clocks may drift apart.
TEST(Attack, ADelayThatCreepsEndsAtTheExpiry) {
  Delayed d;
  Nanoseconds worst = 0, first_expired = 0;
  for (int i = 0; i < 120'000 && first_expired == 0; ++i) {
    const Nanoseconds sent = kSecond + i * kMillisecond;
    const Nanoseconds hold = 20 * kMillisecond + (sent - kSecond) / 100;  // 10 ms more each second
    d.deliver(d.sealed_at(sent), sent + hold);
    const Played<1> played = d.receiver.play(sent + hold);
    if (d.last == Receipt::kExpired) first_expired = sent + hold;
    if (d.receiver.alive(sent + hold)) worst = std::max(worst, sent + hold - played.content_time);
  }
  std::printf("10 ms more each second: refused from %.1f s on, nothing shown was older than %.0f ms\n",
              to_seconds(first_expired - kSecond), 1e3 * to_seconds(worst));
  EXPECT_GT(first_expired, 0);
  EXPECT_LT(worst, 20 * kMillisecond + kSecond / 2 + 200 * kMillisecond) << "delay, expiry, play-out";
}

TEST(Attack, AFloodOfTenForeignDatagramsForEachPacketChangesNothing) {
  Session session;
  std::mt19937_64 bits(3);
  const Bytes authentic = session.seal();
  std::uint64_t opened = session.to_station.counters().opened;
  for (int i = 0; i < 20'000; ++i) {
    for (int flood = 0; flood < 10; ++flood) {
      Bytes junk = authentic;
      if (bits() % 2 == 0) junk.resize(bits() % junk.size());
      for (std::size_t at = 2; at < junk.size(); at += 8) junk[at] = static_cast<std::byte>(bits());
      if (!junk.empty() && bits() % 4 == 0) junk[0] = static_cast<std::byte>(bits());
      const bool own_address = bits() % 2 == 0;
      ASSERT_NE(session.arrive(junk, own_address ? kDialerAt : kElsewhere), Incoming::kPacket);
    }
    ASSERT_EQ(session.send(), Incoming::kPacket);
    ASSERT_EQ(session.to_station.peer(), kDialerAt);
  }
  EXPECT_EQ(session.to_station.counters().opened - opened, 20'000u);
  EXPECT_EQ(session.to_station.counters().sessions, 1u);
}

TEST(Attack, APlainPacketWithItsChecksumIsNoPacket) {
  Session session;
  for (std::uint32_t seq = 1; seq < 100; ++seq) {
    EXPECT_EQ(session.arrive(packet_of(seq, session.network.now())), Incoming::kRejected);
    Bytes framed = session.seal();  // the right header, the packet in the clear
    const Bytes plain = packet_of(seq, session.network.now());
    std::copy(plain.begin(), plain.end(), framed.begin() + 12);
    EXPECT_EQ(session.arrive(framed), Incoming::kRejected);
  }
  EXPECT_EQ(session.send(), Incoming::kPacket);
}

// Both hellos in the clear, byte by byte: what is offered (version, suites, SRTP profile, extensions) cannot be changed
// to anything that both then agree on.
TEST(Attack, AHelloChangedOnThePathLeadsToNoWeakerSession) {
  int harmless = 0, refused = 0;
  for (const UdpEndpoint& of : {kDialerAt, kListenerAt}) {
    for (std::size_t at = 0; at < 170; ++at) {
      HandshakeNetwork network({}, 1);
      Party& dialer = network.add(box(), kDialerAt);
      Party& listener = network.add(station(), kListenerAt);
      network.on_path = [&](const UdpEndpoint& from, HandshakeDatagram& datagram) {
        const bool hello = datagram.size > 13 && datagram.bytes[0] == std::byte{22} &&
                           (datagram.bytes[13] == std::byte{1} || datagram.bytes[13] == std::byte{2});
        if (from == of && hello && at < datagram.size) datagram.bytes[at] ^= std::byte{1};
        return true;
      };
      network.run(300 * kMillisecond);
      // Only the number of a record may be what it likes.
      const bool agreed = !dialer.sessions.empty() || !listener.sessions.empty();
      ++(agreed ? harmless : refused);
      if (!agreed) continue;
      EXPECT_TRUE(at < 13) << "byte " << at << " is inside the handshake";
      ASSERT_FALSE(dialer.sessions.empty() || listener.sessions.empty());
      std::span<std::byte> opened;
      Bytes sealed = copy_of(dialer.sessions[0]->seal(packet_of(1, 0)));
      EXPECT_EQ(listener.sessions[0]->open(sealed, opened), MediaSession::Opening::kOpened);
    }
  }
  std::printf("%d changed hellos led to no session, %d to the same one\n", refused, harmless);
  EXPECT_GT(refused, 250);
}

// What the heap holds for the program now. Under a sanitizer always 0, and nothing is asserted then.
std::size_t heap_bytes() { return ::mallinfo2().uordblks; }

// A caller that takes the cookie back, so that it gets a place, and then says `more` or nothing.
void half_open(Handshaker& listener, DtlsContext& context, const UdpEndpoint& from, Nanoseconds now,
               const std::function<Bytes(const Bytes& flight, int step)>& more, int steps) {
  Dtls caller(context);
  caller.step();
  HandshakeDatagram answer;
  for (int word = 0; word < 2; ++word) {
    for (const Bytes& bytes : caller.take_written()) listener.receive(to_datagram(from, bytes), now);
    while (listener.take_outgoing(answer)) caller.step(answer.view());
  }
  const std::vector<Bytes> flight = caller.take_written();
  for (int step = 0; step < steps; ++step) {
    if (!flight.empty()) listener.receive(to_datagram(from, more(flight[0], step)), now + step * kSecond);
    listener.advance(now + step * kSecond);
    while (listener.take_outgoing(answer)) {
    }
  }
  while (listener.take_event()) {
  }
}

TEST(Attack, HalfOpenHandshakesKeepNoMemoryAndTheRightOneGetsIn) {
  HandshakeNetwork network({}, 1);
  Party& listener = network.add(station(), kListenerAt);
  DtlsContext context(LinkEnd::kDialer, kOtherKey);
  std::size_t first = 0, second = 0;  // the most of each half: some 80 of them are under way at a time
  for (std::uint16_t port = 2000; port < 4000; ++port) {
    // None goes on, and each is given up after ten seconds.
    half_open(*listener.handshaker, context, endpoint(port), network.now(), {}, 0);
    network.run(130 * kMillisecond);
    listener.handshaker->advance(network.now());
    listener.events.clear();  // how each ended is kept by the test only
    std::size_t& most = port < 3000 ? first : second;
    most = std::max(most, heap_bytes());
  }
  std::printf("heap with 1000 half-open handshakes %zu kB, with 1000 more %zu kB\n", first / 1000, second / 1000);
  EXPECT_LT(second, first + 100'000);
  Party& right = network.add(box(), kDialerAt);
  EXPECT_TRUE(network.run_until([&] { return !right.sessions.empty() && !listener.sessions.empty(); }, 5 * kSecond));
}

// One byte of its flight a second, as a fragment of its own: OpenSSL would put them together, and waits for the rest.
TEST(Attack, AHandshakeOneByteAtATimeIsGivenUp) {
  HandshakeNetwork network({}, 1);
  Party& listener = network.add(station(), kListenerAt);
  DtlsContext context(LinkEnd::kDialer, kKey);
  const auto byte_of = [](const Bytes& flight, int step) {
    // Record head (13, its length at 11) and fragment head (12: offset at 6, length at 9), then a single byte.
    Bytes fragment(flight.begin(), flight.begin() + 26);
    fragment[11] = std::byte{0}, fragment[12] = std::byte{13};
    fragment[10] = static_cast<std::byte>(step);  // of the record's number
    fragment[19] = fragment[20] = std::byte{0}, fragment[21] = static_cast<std::byte>(step);
    fragment[22] = fragment[23] = std::byte{0}, fragment[24] = std::byte{1};
    fragment[25] = flight[25 + static_cast<std::size_t>(step) % 16];
    return fragment;
  };
  std::size_t after_few = 0;
  for (std::uint16_t caller = 0; caller < 200; ++caller) {
    half_open(*listener.handshaker, context, endpoint(static_cast<std::uint16_t>(2000 + caller)),
              network.now() + caller * 30 * kSecond, byte_of, 25);
    if (caller == 20) after_few = heap_bytes();
  }
  EXPECT_LT(heap_bytes(), after_few + 100'000);
  EXPECT_TRUE(listener.handshaker->take_session() == nullptr);
  network.run(kMillisecond);
  EXPECT_TRUE(listener.sessions.empty());
}

TEST(Attack, ForgedAlertsAndHellosInMidSessionChangeNothing) {
  Session session;
  HandshakeNetwork& network = session.network;
  network.run(2 * kSecond);
  const std::size_t events = session.dialer.events.size() + session.listener.events.size();
  DtlsContext stranger(LinkEnd::kDialer, kOtherKey);
  Dtls hello(stranger);
  hello.step();
  const Bytes hello_bytes = hello.take_written().at(0);
  for (int round = 0; round < 200; ++round) {
    for (const auto& [level, what] : {std::pair{1, 0}, std::pair{2, 20}, std::pair{2, 40}, std::pair{1, 90}}) {
      for (const int epoch : {0, 1}) {
        Bytes alert(15);
        const int head[] = {21, 254, 253, 0, epoch, 0, 0, 0, 0, round >> 8, round & 255, 0, 2, level, what};
        std::transform(std::begin(head), std::end(head), alert.begin(),
                       [](int b) { return static_cast<std::byte>(b); });
        network.inject(kDialerAt, kListenerAt, alert);
        network.inject(kListenerAt, kDialerAt, alert);
        network.inject(kElsewhere, kListenerAt, alert);
      }
    }
    network.inject(kElsewhere, kListenerAt, hello_bytes);
    network.inject(kDialerAt, kListenerAt, hello_bytes);
    network.inject(kListenerAt, kDialerAt, hello_bytes);
    network.run(20 * kMillisecond);
    ASSERT_EQ(session.send(), Incoming::kPacket) << round;
    EXPECT_EQ(session.to_station.retire(network.now()), nullptr);
  }
  EXPECT_TRUE(session.dialer.sessions.empty() && session.listener.sessions.empty()) << "no other was made";
  EXPECT_EQ(session.dialer.events.size() + session.listener.events.size(), events);
  EXPECT_EQ(session.to_station.counters().sessions, 1u);
}

// It cannot be told from the box after a restart: one key is for one box. Half a takeover there is not.
TEST(Attack, ASecondHolderOfTheKeyTakesOverWhole) {
  Session session;
  Party& second = session.network.add(box(), kElsewhere);
  ASSERT_TRUE(session.network.run_until([&] { return !second.sessions.empty() && !session.listener.sessions.empty(); },
                                        kSecond));
  session.to_station.offer(Session::take(session.listener), session.network.now());
  for (int i = 0; i < 100; ++i) ASSERT_EQ(session.send(), Incoming::kPacket) << "a handshake alone changes nothing";
  EXPECT_EQ(session.to_station.peer(), kDialerAt);
  EXPECT_EQ(session.arrive(copy_of(second.sessions[0]->seal(packet_of(1, 0))), kDialerAt), Incoming::kRejected)
      << "nor from the address of the first";
  EXPECT_EQ(session.arrive(copy_of(second.sessions[0]->seal(packet_of(2, 0))), kElsewhere), Incoming::kPacket);
  EXPECT_EQ(session.to_station.peer(), kElsewhere);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(session.send(), Incoming::kRejected) << "the first is out, as a whole";
}

}  // namespace
}  // namespace farhand
