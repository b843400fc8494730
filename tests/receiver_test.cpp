// The receiver against closed forms, against random links, and in virtual hours.
#include "common/link/receiver.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "tests/support/receiver_path.hpp"

namespace farhand {
namespace {

TEST(Receiver, HasNothingToShowBeforeTheFirstPacket) {
  const auto receiver = make_receiver();
  EXPECT_FALSE(receiver->play(123).any);
  EXPECT_FALSE(receiver->heard());
  EXPECT_FALSE(receiver->alive(0));
  EXPECT_FALSE(receiver->rtt().has_value());
  Packet<1> outgoing;
  receiver->echo(outgoing, 5);
  EXPECT_EQ(outgoing.echo_session, 0u);
}

TEST(Receiver, ShowsTheFirstPacketAtOnce) {
  const auto receiver = make_receiver();
  EXPECT_EQ(receiver->accept(packet_at(1, -900 * kSecond, 0.25), 7 * kSecond), Receipt::kAccepted);
  const Played<1> played = receiver->play(7 * kSecond);
  EXPECT_TRUE(played.any);
  EXPECT_EQ(played.motion.x[0], 0.25);
  EXPECT_EQ(played.depth, 0);
  EXPECT_EQ(played.content_time, -900 * kSecond);
}

TEST(Receiver, ConstantLinkPlaysEveryPacketExactlyOneDelayLater) {
  for (const Nanoseconds delay : {Nanoseconds{0}, 1 * kMillisecond, 100 * kMillisecond, 1000 * kMillisecond}) {
    const auto receiver = make_receiver();
    const Path path{.link = {.delay_s = to_seconds(delay), .distribution = DelayDistribution::kConstant}};
    int shown = 0;
    path.run(10 * kSecond, *receiver, [&](Nanoseconds now, const Played<1>& played) {
      ASSERT_EQ(played.content_time, now - delay);
      ASSERT_EQ(played.motion.x[0], to_seconds(now - delay));
      ASSERT_EQ(played.depth, 0);
      ASSERT_FALSE(played.held);
      ++shown;
    });
    EXPECT_EQ(shown, (10 * kSecond - delay) / kMillisecond);
  }
}

TEST(Receiver, ConstantLinkPlaysEveryPacketExactlyWhateverThePhaseOfTheTicks) {
  for (const Nanoseconds phase : {100'000, 400'000, 999'999}) {
    const auto receiver = make_receiver();
    const Path path{.link = {.delay_s = 0.1003, .distribution = DelayDistribution::kConstant}, .sender_phase = phase};
    Nanoseconds previous = -1;
    path.run(10 * kSecond, *receiver, [&](Nanoseconds, const Played<1>& played) {
      if (previous >= 0) {
        ASSERT_EQ(played.content_time, previous + kMillisecond);
      }
      previous = played.content_time;
      ASSERT_EQ(played.motion.x[0], to_seconds(played.content_time));
      ASSERT_EQ(played.depth, 0);
      ASSERT_FALSE(played.held);
    });
  }
}

TEST(Receiver, LossOnAConstantLinkHoldsForTheTickAndChangesNothingElse) {
  const auto receiver = make_receiver();
  const Path path{.link = {.delay_s = 0.1, .distribution = DelayDistribution::kConstant, .loss = 0.05}};
  int held = 0, shown = 0;
  const auto counters = path.run(20 * kSecond, *receiver, [&](Nanoseconds now, const Played<1>& played) {
    ++shown;
    held += played.held;
    ASSERT_EQ(played.motion.x[0], to_seconds(played.content_time));
    if (!played.held) {
      ASSERT_EQ(played.content_time, now - 100 * kMillisecond);
    }
    ASSERT_EQ(played.depth, 0);
  });
  EXPECT_NEAR(held, 0.05 * shown, 5 * std::sqrt(0.05 * shown));
  EXPECT_NEAR(static_cast<double>(counters.lost), held, 5.0);  // the last ones may not be passed yet
  EXPECT_EQ(counters.late + counters.reordered + counters.duplicate, 0u);
}

TEST(Receiver, DuplicatesAndReorderingAreTold) {
  const auto receiver = make_receiver();
  const auto at = [](std::uint32_t seq) { return packet_at(seq, seq * kMillisecond, seq); };
  EXPECT_EQ(receiver->accept(at(10), 100 * kMillisecond), Receipt::kAccepted);
  receiver->play(100 * kMillisecond);
  EXPECT_EQ(receiver->accept(at(12), 101 * kMillisecond), Receipt::kAccepted);
  EXPECT_EQ(receiver->accept(at(11), 101 * kMillisecond), Receipt::kReordered);
  EXPECT_EQ(receiver->accept(at(11), 101 * kMillisecond), Receipt::kDuplicate);
  EXPECT_EQ(receiver->accept(at(12), 101 * kMillisecond), Receipt::kDuplicate);
  EXPECT_EQ(receiver->accept(at(9), 101 * kMillisecond), Receipt::kLate);
  EXPECT_EQ(receiver->accept(at(9), 101 * kMillisecond), Receipt::kDuplicate);
  EXPECT_EQ(receiver->newest().seq, 12u);
  EXPECT_EQ(receiver->counters().received, 3u);
  EXPECT_EQ(receiver->counters().duplicate, 3u);
}

TEST(Receiver, SequenceNumbersMayWrap) {
  const auto receiver = make_receiver();
  for (std::uint32_t k = 0; k < 10000; ++k) {
    const Nanoseconds now = k * kMillisecond;
    ASSERT_EQ(receiver->accept(packet_at(k - 5000u, now, k), now), Receipt::kAccepted);
    ASSERT_EQ(receiver->play(now).motion.x[0], k);
  }
  EXPECT_EQ(receiver->counters().lost, 0u);
}

// The largest step forward that a number of 32 bits can make: a loop over what may have come in between has to end.
TEST(Receiver, ASequenceNumberHalfWayRoundIsPlayedAtOnce) {
  constexpr std::uint32_t kHalf = 0x7FFFFFFF;
  const auto receiver = make_receiver();
  for (std::uint32_t k = 1; k <= 3; ++k) {
    const Nanoseconds now = k * kMillisecond;
    ASSERT_EQ(receiver->accept(packet_at(1 + k * kHalf, now, k), now), Receipt::kAccepted);
    ASSERT_EQ(receiver->play(now).motion.x[0], k);
  }
  EXPECT_EQ(receiver->counters().lost, 2 * (std::uint64_t{kHalf} - 1));
}

TEST(Receiver, ANewSessionStartsOverAndTheOldOneStaysOut) {
  const auto receiver = make_receiver();
  for (std::uint32_t k = 0; k < 2000; ++k) {
    receiver->accept(packet_at(k, k * kMillisecond, 1.0), k * kMillisecond);
    receiver->play(k * kMillisecond);
  }
  Packet<1> restarted = packet_at(1, -5000 * kSecond, 2.0);
  restarted.session = 78;
  EXPECT_EQ(receiver->accept(restarted, 2000 * kMillisecond), Receipt::kAccepted);
  const Played<1> played = receiver->play(2000 * kMillisecond);
  EXPECT_EQ(played.motion.x[0], 2.0);
  EXPECT_EQ(played.content_time, -5000 * kSecond);
  EXPECT_EQ(receiver->accept(packet_at(2001, 2001 * kMillisecond, 3.0), 2001 * kMillisecond), Receipt::kSession);
  EXPECT_EQ(receiver->play(2001 * kMillisecond).motion.x[0], 2.0);
  EXPECT_EQ(receiver->counters().sessions, 2u);
  EXPECT_EQ(receiver->counters().rejected_session, 1u);
}

TEST(Receiver, AStalledLinkThatResumesPlaysNothingOld) {
  const auto receiver = make_receiver();
  std::uint32_t k = 0;
  for (; k < 5000; ++k) {
    receiver->accept(packet_at(k, k * kMillisecond, k), (k + 20) * kMillisecond);
    receiver->play((k + 20) * kMillisecond);
  }
  // Ten seconds of packets lie in a queue and come at once.
  const Nanoseconds now = 15020 * kMillisecond;
  EXPECT_FALSE(receiver->alive(now));
  const double shown_before = receiver->play(now).motion.x[0];
  EXPECT_EQ(shown_before, 4999);
  int expired = 0;
  for (; k <= 15000; ++k) {
    const Receipt receipt = receiver->accept(packet_at(k, k * kMillisecond, k), now);
    expired += receipt == Receipt::kExpired;
    // A clock may drift by 1/1000 of the ten seconds without a packet.
    if (15000 - k > 2011) {
      EXPECT_EQ(receipt, Receipt::kExpired) << k;
    }
    if (15000 - k < 2000) {
      EXPECT_EQ(receipt, Receipt::kAccepted) << k;
    }
  }
  const Played<1> played = receiver->play(now);
  EXPECT_EQ(played.motion.x[0], 15000);  // the newest at once
  EXPECT_EQ(receiver->counters().rejected_expired, static_cast<std::uint64_t>(expired));
  EXPECT_EQ(receiver->counters().lost, 0u);
}

TEST(Receiver, TheSendersExpiryCountsWhereItIsShorter) {
  const auto receiver = make_receiver();
  receiver->accept(packet_at(1, 0), 0);
  receiver->play(0);
  Packet<1> packet = packet_at(2, kMillisecond);
  packet.expiry_ms = 50;
  EXPECT_EQ(receiver->accept(packet, 53 * kMillisecond), Receipt::kExpired);
  packet.seq = 3;
  EXPECT_EQ(receiver->accept(packet, 50 * kMillisecond), Receipt::kAccepted);
}

TEST(Receiver, SilenceCountsFromTheLastUsefulArrivalOnTheLocalClock) {
  const auto receiver = make_receiver();
  receiver->accept(packet_at(5, 1'000'000 * kSecond), 3 * kSecond);
  receiver->play(3 * kSecond);
  EXPECT_EQ(receiver->silence(3 * kSecond + 7), 7);
  EXPECT_TRUE(receiver->alive(3 * kSecond + kParams.timeout));
  EXPECT_FALSE(receiver->alive(3 * kSecond + kParams.timeout + 1));
  receiver->accept(packet_at(5, 1'000'000 * kSecond), 4 * kSecond);  // a replay is no sign of life
  EXPECT_FALSE(receiver->alive(4 * kSecond));
}

TEST(Receiver, ASilenceThatNoTickSawIsToldOnce) {
  const auto receiver = make_receiver();
  receiver->accept(packet_at(1, 0), 0);
  receiver->accept(packet_at(2, kMillisecond), kParams.timeout);
  EXPECT_FALSE(receiver->take_lapse());
  receiver->accept(packet_at(3, 2 * kMillisecond), 2 * kParams.timeout + 1);
  receiver->accept(packet_at(4, 3 * kMillisecond), 2 * kParams.timeout + 1);
  EXPECT_TRUE(receiver->alive(2 * kParams.timeout + 1));
  EXPECT_TRUE(receiver->take_lapse());
  EXPECT_FALSE(receiver->take_lapse());
  Packet<1> other = packet_at(1, 0);
  for (const StationState state : {StationState::kReady, StationState::kEngaged}) {
    ++other.session, other.state = state;
    receiver->accept(other, 2 * kParams.timeout + 1);
    EXPECT_EQ(receiver->take_lapse(), state == StationState::kEngaged);
  }
}

TEST(Receiver, RoundTripNeedsNoCommonClock) {
  const auto here = make_receiver();
  const auto there = std::make_unique<Receiver1>(kParams, kSession);
  const Nanoseconds clock_there = 1'000'000 * kSecond;
  Packet<1> ping = packet_at(9, 5 * kSecond);
  ping.session = kOwn;
  there->accept(ping, clock_there + 30 * kMillisecond);
  Packet<1> pong = packet_at(1, clock_there + 42 * kMillisecond);
  there->echo(pong, clock_there + 42 * kMillisecond);
  EXPECT_EQ(pong.echo_session, kOwn);
  EXPECT_EQ(pong.echo_seq, 9u);
  EXPECT_EQ(pong.echo_dwell_ns, 12'000'000u);
  here->accept(pong, 5 * kSecond + 30 * kMillisecond + 12 * kMillisecond + 55 * kMillisecond);
  ASSERT_TRUE(here->rtt().has_value());
  EXPECT_EQ(*here->rtt(), 85 * kMillisecond);
  pong.seq = 2;
  pong.send_time_ns += kMillisecond;
  pong.echo_session = 1234;  // what an earlier run of this station had sent
  pong.echo_send_time_ns = 0;
  here->accept(pong, 6 * kSecond);
  EXPECT_EQ(*here->rtt(), 85 * kMillisecond);
}

TEST(Receiver, NonFiniteMotionNeverGetsIn) {
  const auto receiver = make_receiver();
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (int field = 0; field < 3; ++field) {
      Packet<1> packet = packet_at(1, 0);
      (field == 0 ? packet.motion.x : field == 1 ? packet.motion.v : packet.motion.f)[0] = bad;
      EXPECT_EQ(receiver->accept(packet, 0), Receipt::kNotFinite);
    }
  }
  EXPECT_FALSE(receiver->play(0).any);
  EXPECT_EQ(receiver->counters().rejected_not_finite, 9u);
}

TEST(Receiver, AStampThatContradictsItsSequenceNumberIsRejected) {
  const auto receiver = make_receiver();
  receiver->accept(packet_at(10, 10 * kMillisecond), 0);
  EXPECT_EQ(receiver->accept(packet_at(11, 9 * kMillisecond), 0), Receipt::kStamp);
  EXPECT_EQ(receiver->accept(packet_at(9, 11 * kMillisecond), 0), Receipt::kStamp);
  EXPECT_EQ(receiver->accept(packet_at(12, std::numeric_limits<Nanoseconds>::max()), 0), Receipt::kStamp);
  EXPECT_EQ(receiver->accept(packet_at(13, std::numeric_limits<Nanoseconds>::min()), 0), Receipt::kStamp);
}

TEST(Receiver, APacketStormStaysBounded) {
  const auto receiver = make_receiver();
  std::uint64_t seed = 1;
  for (std::uint32_t k = 0; k < 1000; ++k) {
    receiver->accept(packet_at(k, k * kMillisecond, 0.5), k * kMillisecond);
    receiver->play(k * kMillisecond);
  }
  for (int tick = 0; tick < 5; ++tick) {
    const Nanoseconds now = (1000 + tick) * kMillisecond;
    for (int i = 0; i < 100000; ++i) {
      Packet<1> packet =
          packet_at(static_cast<std::uint32_t>(split_mix(seed)), static_cast<Nanoseconds>(split_mix(seed)), 0.5);
      if (i % 3 == 0) packet.session = static_cast<std::uint32_t>(split_mix(seed));
      receiver->accept(packet, now);
    }
    EXPECT_EQ(receiver->play(now).motion.x[0], 0.5);
  }
  const ReceiverCounters& c = receiver->counters();
  EXPECT_EQ(c.received + c.late + c.duplicate + c.rejected_session + c.rejected_expired + c.rejected_stamp, 501000u);
}

TEST(Receiver, AnythingOnTheWireLeavesTheOutputFiniteAndOrdered) {
  std::uint64_t seed = 12;
  const auto receiver = make_receiver();
  const auto finite = [&] {
    for (;;) {
      const double value = std::bit_cast<double>(split_mix(seed));
      if (std::isfinite(value)) return value;
    }
  };
  for (int c = 0; c < 10000; ++c) {
    Nanoseconds now = static_cast<Nanoseconds>(split_mix(seed) >> 4), shown = 0,
                stamp = static_cast<Nanoseconds>(split_mix(seed));
    std::uint32_t seq = static_cast<std::uint32_t>(split_mix(seed));
    bool any = false;
    for (int i = 0; i < 30; ++i) {
      Packet<1> packet = packet_at(seq, stamp, finite());
      packet.session = static_cast<std::uint32_t>(c);
      packet.motion.v[0] = finite();
      receiver->accept(packet, now);
      seq += static_cast<std::uint32_t>(split_mix(seed) >> (32 + split_mix(seed) % 32));
      stamp = static_cast<Nanoseconds>(static_cast<std::uint64_t>(stamp) + (split_mix(seed) >> (split_mix(seed) % 64)));
      now += static_cast<Nanoseconds>(split_mix(seed) >> (20 + split_mix(seed) % 44));
      const Played<1> played = receiver->play(now);
      ASSERT_TRUE(played.motion.finite());
      ASSERT_GE(played.depth, 0);
      if (any) {
        ASSERT_GE(static_cast<Nanoseconds>(static_cast<std::uint64_t>(played.content_time) -
                                           static_cast<std::uint64_t>(shown)),
                  0);
      }
      any = true;
      shown = played.content_time;
    }
  }
}

TEST(Receiver, OnAnyLinkTimeRunsForwardAndStaysBetweenWhatArrived) {
  std::uint64_t seed = 13;
  const auto receiver = make_receiver();
  for (int c = 0; c < 10000; ++c) {
    const Nanoseconds clock = static_cast<Nanoseconds>(split_mix(seed) >> 2) - (Nanoseconds{1} << 61);
    const double spread = 60e6 * unit(seed), loss = 0.5 * unit(seed), twice = 0.2 * unit(seed);
    const Nanoseconds tick = 500'000 + static_cast<Nanoseconds>(1e6 * unit(seed));
    std::vector<std::pair<Nanoseconds, Packet<1>>> arrivals;
    for (std::uint32_t k = 0; k < 150; ++k) {
      const Nanoseconds stamp = k * kMillisecond;
      const int copies = unit(seed) < loss ? 0 : unit(seed) < twice ? 2 : 1;
      for (int i = 0; i < copies; ++i) {
        Packet<1> packet = packet_at(k + 4294967200u, clock + stamp, 2 * unit(seed) - 1);
        packet.session = static_cast<std::uint32_t>(c + 1);
        if (i > 0) packet = arrivals.back().second;
        arrivals.emplace_back(stamp + static_cast<Nanoseconds>(spread * unit(seed)), packet);
      }
    }
    std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const ReceiverCounters before = receiver->counters();
    std::size_t next = 0;
    bool any = false;
    double low = 1e9, high = -1e9;
    Nanoseconds newest = std::numeric_limits<Nanoseconds>::min(), shown = 0;
    std::uint32_t first = 0;
    std::vector<bool> arrived(200, false);
    for (Nanoseconds now = 0; now < 400 * kMillisecond; now += tick) {
      for (; next < arrivals.size() && arrivals[next].first <= now; ++next) {
        const Packet<1>& packet = arrivals[next].second;
        const Receipt receipt = receiver->accept(packet, arrivals[next].first);
        const std::uint32_t index = packet.seq - 4294967200u;
        if (arrived[index]) {
          ASSERT_EQ(receipt, Receipt::kDuplicate);
        } else if (any && packet.send_time_ns <= shown) {
          ASSERT_EQ(receipt, Receipt::kLate);
        } else {
          ASSERT_EQ(receipt, packet.send_time_ns > newest ? Receipt::kAccepted : Receipt::kReordered);
          low = std::min(low, packet.motion.x[0]);
          high = std::max(high, packet.motion.x[0]);
        }
        arrived[index] = true;
        newest = std::max(newest, packet.send_time_ns);
      }
      if (low > high) continue;
      const Played<1> played = receiver->play(now);
      if (!any) first = static_cast<std::uint32_t>((newest - clock) / kMillisecond);
      if (any) {
        ASSERT_GE(played.content_time, shown);
      }
      ASSERT_LE(played.content_time, newest);
      ASSERT_GE(played.motion.x[0], low);
      ASSERT_LE(played.motion.x[0], high);
      any = true;
      shown = played.content_time;
    }
    if (!any) continue;
    ASSERT_EQ(shown, newest);
    std::uint64_t missing = 0;
    for (std::uint32_t k = first + 1; k < static_cast<std::uint32_t>((newest - clock) / kMillisecond); ++k)
      missing += !arrived[k];
    ASSERT_EQ(receiver->counters().lost - before.lost, missing) << c;
    ASSERT_EQ(receiver->counters().rejected_expired, 0u);
    ASSERT_EQ(receiver->counters().rejected_stamp, 0u);
  }
}

}  // namespace
}  // namespace farhand
