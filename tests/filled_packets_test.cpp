// Lost packets that the receiver fills from the packet after them: the motion shown, the counters, and hostile ages.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "tests/support/receiver_path.hpp"

namespace farhand {
namespace {

// Velocity as an encoder's counts leave it: no straight line between its neighbours.
double rough(std::uint32_t seq) { return seq % 3 == 0 ? 1.0 : seq % 3 == 1 ? -0.5 : 0.2; }

Packet<1> told(std::uint32_t seq, bool previous) {
  Packet<1> packet = packet_at(seq, seq * kMillisecond, 1e-3 * seq);
  packet.motion.v[0] = rough(seq);
  if (previous && seq > 1) {
    packet.previous_age_ns = kMillisecond;
    packet.previous.x[0] = 1e-3 * (seq - 1);
    packet.previous.v[0] = rough(seq - 1);
  }
  return packet;
}

struct Shown {
  ReceiverCounters counters;
  std::vector<Nanoseconds> content;
  int wrong = 0, all = 0;  // velocities shown that were not sent at that time, of those shown
};

Shown over(const LinkModelParams& link, std::uint64_t seed, bool previous) {
  const auto receiver = make_receiver();
  LinkModel model(link, seed, LinkDirection::kForward);
  std::multimap<Nanoseconds, std::uint32_t> way;
  Shown shown;
  for (std::uint32_t k = 1; k <= 20'000; ++k) {
    const Nanoseconds now = k * kMillisecond;
    const LinkModel::Fate fate = model.offer(now);
    if (!fate.lost) way.emplace(now + fate.delay, k);
    for (; !way.empty() && way.begin()->first <= now; way.erase(way.begin())) {
      receiver->accept(told(way.begin()->second, previous), way.begin()->first);
    }
    const Played<1> played = receiver->play(now);
    if (!played.any) continue;
    shown.content.push_back(played.content_time);
    if (k < 5'000 || played.content_time % kMillisecond != 0) continue;  // the play-out has found its depth
    const auto sent = static_cast<std::uint32_t>(played.content_time / kMillisecond);
    shown.wrong += played.motion.v[0] != rough(sent) ? 1 : 0;
    ++shown.all;
  }
  shown.counters = receiver->counters();
  return shown;
}

const LinkModelParams kJittery{
    .delay_s = 0.1, .jitter_s = 0.05, .distribution = DelayDistribution::kUniform, .loss = 0.1};

TEST(FilledPackets, OnlyTwoLostInARowLeaveAGap) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Shown with = over(kJittery, seed, true), without = over(kJittery, seed, false);
    ASSERT_GT(with.all, 5'000);
    // A tenth is lost, and with it a hundredth twice in a row; the margin is four standard deviations.
    EXPECT_GT(without.wrong, 0.08 * without.all) << seed;
    EXPECT_LT(with.wrong, 0.02 * with.all) << seed;
  }
}

TEST(FilledPackets, ChangeNeitherTheTimeShownNorWhatIsCounted) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Shown with = over(kJittery, seed, true), without = over(kJittery, seed, false);
    EXPECT_EQ(with.content, without.content) << seed;
    EXPECT_EQ(with.counters.received, without.counters.received) << seed;
    EXPECT_EQ(with.counters.reordered, without.counters.reordered) << seed;
    EXPECT_EQ(with.counters.lost, without.counters.lost) << seed;
    EXPECT_EQ(with.counters.late, without.counters.late) << seed;
    EXPECT_EQ(with.counters.duplicate, 0u) << seed;
  }
}

TEST(FilledPackets, ChangeNothingWhereNothingIsLost) {
  const LinkModelParams link{.delay_s = 0.1, .distribution = DelayDistribution::kConstant};
  const Shown with = over(link, 1, true), without = over(link, 1, false);
  EXPECT_EQ(with.wrong, 0);
  EXPECT_EQ(without.wrong, 0);
  EXPECT_EQ(with.content, without.content);
  EXPECT_EQ(with.counters.lost, 0u);
}

TEST(FilledPackets, ASampleFromBeforeAStallIsNoNeighbour) {
  for (const std::uint32_t age : {1'000'000u, 20'000'000u, 20'000'001u, std::numeric_limits<std::uint32_t>::max()}) {
    const auto receiver = make_receiver();
    for (std::uint32_t seq = 1; seq <= 10; ++seq) {
      receiver->accept(told(seq, true), seq * kMillisecond);
      receiver->play(seq * kMillisecond);
    }
    Packet<1> packet = told(12, true);
    packet.send_time_ns = 10 * kMillisecond + Nanoseconds{age} + kMillisecond;
    packet.previous_age_ns = age;
    packet.previous.v[0] = 7.0;
    const Nanoseconds before = packet.send_time_ns - Nanoseconds{age};
    receiver->accept(packet, packet.send_time_ns);
    const Played<1> played = receiver->play(before);
    EXPECT_EQ(played.motion.v[0] == 7.0, age <= 20'000'000u) << age;
  }
}

TEST(FilledPackets, APreviousSampleThatIsNoNumberIsRejected) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (int field = 0; field < 3; ++field) {
      const auto receiver = make_receiver();
      Packet<1> packet = told(5, true);
      (field == 0 ? packet.previous.x : field == 1 ? packet.previous.v : packet.previous.f)[0] = bad;
      EXPECT_EQ(receiver->accept(packet, kSecond), Receipt::kNotFinite);
      EXPECT_FALSE(receiver->heard());
    }
  }
}

// A peer that holds the key, and tells any number, age and sample.
TEST(FilledPackets, WhateverThePeerTellsTimeRunsForwardAndEveryPacketIsCountedOnce) {
  std::uint64_t dice = 4;
  for (int run = 0; run < 200; ++run) {
    const auto receiver = make_receiver();
    Nanoseconds now = kSecond;
    std::uint32_t seq = 1;
    Nanoseconds shown = std::numeric_limits<Nanoseconds>::min();
    std::uint64_t accepted = 0;
    for (int k = 0; k < 500; ++k) {
      now += static_cast<Nanoseconds>(split_mix(dice) % 3) * kMillisecond;
      seq += static_cast<std::uint32_t>(split_mix(dice) % 4);
      const std::uint32_t back = static_cast<std::uint32_t>(split_mix(dice) % 8);
      Packet<1> packet = packet_at(seq > back ? seq - back : seq, now - back * kMillisecond, unit(dice));
      packet.previous_age_ns = static_cast<std::uint32_t>(split_mix(dice) % 30'000'000);
      if (split_mix(dice) % 8 == 0) packet.previous_age_ns = static_cast<std::uint32_t>(split_mix(dice));
      packet.previous.x[0] = unit(dice);
      const Receipt receipt = receiver->accept(packet, now);
      accepted += receipt == Receipt::kAccepted || receipt == Receipt::kReordered ? 1 : 0;
      const bool told = receiver->take_lapse();
      const Played<1> played = receiver->play(now);
      if (!played.any) continue;
      ASSERT_TRUE(played.motion.finite());
      ASSERT_TRUE(told || played.content_time >= shown) << run << ' ' << k;
      ASSERT_LE(std::abs(played.motion.x[0]), 1.0);
      shown = played.content_time;
    }
    ASSERT_EQ(receiver->counters().received, accepted);
    ASSERT_LE(receiver->counters().lost, std::uint64_t{seq});
  }
}

}  // namespace
}  // namespace farhand
