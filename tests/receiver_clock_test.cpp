// Clocks that are set, machines that were suspended, packets that lay in a queue meanwhile: two receivers that talk.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/receiver_path.hpp"

namespace farhand {
namespace {

// Two receivers that echo each other over ways of 20 to 30 ms, here and there each with a clock of its own that can be
// set while they talk, and with a queue in which packets can be kept back.
struct Conversation {
  struct Side {
    std::unique_ptr<Receiver1> receiver;
    std::uint32_t session, seq = 0;
    Nanoseconds clock = 0, kept_back = 0;
    std::multimap<Nanoseconds, Packet<1>> on_the_way;  // by true arrival
    std::vector<Nanoseconds> sent;                     // true time, by sequence number
    Nanoseconds oldest_taken = 0;                      // flight time
    int taken = 0;
  };

  void tick() {
    now += kMillisecond;
    for (const auto& [from, to] : {std::pair{&here, &there}, {&there, &here}}) {
      Packet<1> packet = packet_at(++from->seq, now + from->clock, to_seconds(now));
      packet.session = from->session;
      from->receiver->echo(packet, now + from->clock);
      from->sent.push_back(now);
      const Nanoseconds jitter = static_cast<Nanoseconds>(random() % 10) * kMillisecond;
      to->on_the_way.emplace(now + 20 * kMillisecond + jitter + to->kept_back, packet);
    }
    for (Side* side : {&here, &there}) {
      while (!side->on_the_way.empty() && side->on_the_way.begin()->first <= now) {
        const Packet<1> packet = side->on_the_way.extract(side->on_the_way.begin()).mapped();
        const Receipt receipt = side->receiver->accept(packet, now + side->clock);
        if (receipt != Receipt::kAccepted && receipt != Receipt::kReordered) continue;
        const Nanoseconds sent = (side == &here ? there : here).sent[packet.seq - 1];
        side->oldest_taken = std::max(side->oldest_taken, now - sent);
        ++side->taken;
      }
      shown[side == &here ? 0 : 1] = side->receiver->play(now + side->clock);
    }
  }
  void run(Nanoseconds span) {
    for (const Nanoseconds until = now + span; now < until;) tick();
  }

  Nanoseconds now = 0;
  std::mt19937_64 random{3};
  Side here{std::make_unique<Receiver1>(kParams, 4u), 4u, 0, 0, 0, {}, {}, 0, 0};
  Side there{std::make_unique<Receiver1>(kParams, 5u), 5u, 0, 1'000'000 * kSecond, 0, {}, {}, 0, 0};
  Played<1> shown[2];
};

TEST(Receiver, AClockThatIsSetOrAMachineThatWasSuspendedIsHeardAgainWithinARoundTripOrTwo) {
  for (const Nanoseconds by :
       {-86400 * kSecond, -3600 * kSecond, -3 * kSecond, 3 * kSecond, 3600 * kSecond, 86400 * kSecond}) {
    for (const bool here : {true, false}) {
      Conversation two;
      two.run(2 * kSecond);
      two.here.receiver->take_lapse(), two.there.receiver->take_lapse();
      (here ? two.here : two.there).clock += by;
      two.run(150 * kMillisecond);
      // Whoever was deaf lets go, as after silence.
      EXPECT_TRUE(two.here.receiver->take_lapse() || two.there.receiver->take_lapse()) << by << here;
      two.here.taken = two.there.taken = 0;
      two.run(2 * kSecond);
      for (const int side : {0, 1}) {
        EXPECT_GT((side == 0 ? two.here : two.there).taken, 1900) << by << here << side;
        EXPECT_NEAR(two.shown[side].motion.x[0], to_seconds(two.now), 0.035) << by << here << side;
      }
    }
  }
}

// Both at once, so that neither takes what the other says: packets are echoed even so.
TEST(Receiver, TwoClocksThatAreSetAtOnceAreHeardAgain) {
  for (const Nanoseconds a : {-900 * kSecond, 900 * kSecond}) {
    for (const Nanoseconds b : {-60 * kSecond, 70 * kSecond}) {
      Conversation two;
      two.run(2 * kSecond);
      two.here.clock += a, two.there.clock += b;
      two.run(200 * kMillisecond);
      EXPECT_TRUE(two.here.receiver->take_lapse() && two.there.receiver->take_lapse()) << a << ' ' << b;
      two.run(2 * kSecond);
      for (const int side : {0, 1})
        EXPECT_NEAR(two.shown[side].motion.x[0], to_seconds(two.now), 0.035) << a << ' ' << b;
    }
  }
}

// Clocks are set by far more than any queue is long: then what lay in the queue for longer than a packet may live is
// never taken for fresh, because the echo that would prove it lay there too.
TEST(Receiver, NoClockThatIsSetMakesAnOldPacketFresh) {
  int taken = 0;
  for (int episode = 0; episode < 40; ++episode) {
    Conversation two;
    two.random.seed(static_cast<std::uint64_t>(episode));
    two.run(kSecond);
    for (int k = 0; k < 10; ++k) {
      auto& side = two.random() % 2 == 0 ? two.here : two.there;
      const auto seconds = static_cast<Nanoseconds>(1 + two.random() % 20);
      if (two.random() % 2 == 0) side.clock += (two.random() % 2 == 0 ? 100 : -100) * seconds * kSecond;
      if (two.random() % 2 == 0) side.kept_back = two.random() % 2 == 0 ? seconds * kSecond : 0;
      two.run(static_cast<Nanoseconds>(100 + two.random() % 900) * kMillisecond);
    }
    // A flight takes 20 to 30 ms, so the shortest round trip may be 20 ms longer than it could be.
    for (const auto* side : {&two.here, &two.there}) {
      EXPECT_LE(side->oldest_taken, kParams.expiry + 50 * kMillisecond) << episode;
      taken += side->taken;
    }
  }
  EXPECT_GT(taken, 100'000);
}

}  // namespace
}  // namespace farhand
