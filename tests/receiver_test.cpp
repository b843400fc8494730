// The receiver against closed forms, against random links, and in virtual hours.
#include "common/link/receiver.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "netem/link_model.hpp"

namespace farhand {
namespace {

constexpr ReceiverParams kParams{.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
constexpr std::uint32_t kSession = 77;
constexpr std::uint32_t kOwn = 5;

using Receiver1 = Receiver<1>;
std::unique_ptr<Receiver1> make_receiver(const ReceiverParams& params = kParams) {
  return std::make_unique<Receiver1>(params, kOwn);
}

std::uint64_t split_mix(std::uint64_t& x) {
  std::uint64_t z = x += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}
double unit(std::uint64_t& seed) { return static_cast<double>(split_mix(seed) >> 11) * 0x1p-53; }

Packet<1> packet_at(std::uint32_t seq, Nanoseconds stamp, double x = 0.0) {
  Packet<1> packet{.session = kSession, .seq = seq, .send_time_ns = stamp, .motion = {}};
  packet.motion.x[0] = x;
  return packet;
}

// One direction in virtual time: a sender that ticks every millisecond of its own clock, a link, a receiver that ticks
// every millisecond. True time is the receiver's.
struct Path {
  LinkModelParams link;
  std::uint64_t seed = 1;
  double offset_s = 0.0;         // sender's clock at true time 0
  double skew_ppm = 0.0;         // how much faster the sender's clock runs
  Nanoseconds sender_phase = 0;  // its first tick
  Nanoseconds tick = kMillisecond;

  // show(now, true sending time of what is shown, played); returns the receiver's counters. A position is the true
  // sending time in s.
  template <class Show>
  ReceiverCounters run(Nanoseconds duration, Receiver1& receiver, Show show) const {
    LinkModel model(link, seed, LinkDirection::kForward);
    struct Flying {
      Nanoseconds due;
      Packet<1> packet;
    };
    const auto later = [](const Flying& a, const Flying& b) {
      return a.due != b.due ? a.due > b.due : a.packet.seq > b.packet.seq;
    };
    std::vector<Flying> heap;
    const double rate = 1.0 + skew_ppm * 1e-6;
    Nanoseconds next_send = sender_phase;
    std::uint32_t seq = 1;
    std::int64_t sent = 0;
    for (Nanoseconds now = 0; now < duration; now += tick) {
      while (next_send <= now) {
        // Stamps are exact multiples of the sender's period; the true instant follows from the rate.
        const Nanoseconds stamp = from_seconds(offset_s) + sender_phase + sent * tick;
        const auto fate = model.offer(next_send);
        if (!fate.lost) {
          heap.push_back({next_send + fate.delay, packet_at(seq, stamp, to_seconds(next_send))});
          std::push_heap(heap.begin(), heap.end(), later);
        }
        ++seq;
        ++sent;
        next_send = sender_phase + static_cast<Nanoseconds>(
                                       std::llround(static_cast<double>(sent) * static_cast<double>(tick) / rate));
      }
      while (!heap.empty() && heap.front().due <= now) {
        receiver.accept(heap.front().packet, heap.front().due);
        std::pop_heap(heap.begin(), heap.end(), later);
        heap.pop_back();
      }
      const Played<1> played = receiver.play(now);
      if (played.any) show(now, played);
    }
    return receiver.counters();
  }
};

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

TEST(Receiver, UniformJitterIsPlayedAtOneAndAHalfDelays) {
  const auto receiver = make_receiver();
  const Path path{.link = {.delay_s = 0.1, .jitter_s = 0.05}};
  double lowest = 1, highest = 0;
  const auto counters = path.run(60 * kSecond, *receiver, [&](Nanoseconds now, const Played<1>& played) {
    if (now < 3 * kSecond) return;
    const double total = to_seconds(now - played.content_time);
    lowest = std::min(lowest, total);
    highest = std::max(highest, total);
    EXPECT_NEAR(to_seconds(played.depth), 0.1, 0.002);
  });
  std::printf("total %.3f .. %.3f ms, late %.3f %%\n", 1e3 * lowest, 1e3 * highest,
              100.0 * static_cast<double>(counters.late) / 60000);
  // The median of bucket maxima lies ln2/250 of the range below its end on average: 0.28 ms; a tick of phase above.
  EXPECT_GT(lowest, 0.148);
  EXPECT_LT(highest, 0.151);
  EXPECT_LT(static_cast<double>(counters.late), 0.01 * 60000);
}

// Sine of 0.2 rad at 1 Hz: peak speed 1.26 rad/s. "Newest packet" would be off by up to its jitter times that: 60 mrad.
double worst_ripple(const LinkModelParams& link, Nanoseconds* spread_of_offset) {
  const auto receiver = make_receiver();
  const auto truth = [](double t) { return 0.2 * std::sin(2 * std::numbers::pi * t); };
  double lowest = 1e9, highest = 0, worst = 0;
  LinkModel model(link, 1, LinkDirection::kForward);
  std::vector<std::pair<Nanoseconds, Packet<1>>> arrivals;
  for (std::uint32_t k = 0; k < 40000; ++k) {
    const Nanoseconds stamp = k * kMillisecond;
    const auto fate = model.offer(stamp);
    if (!fate.lost) arrivals.emplace_back(stamp + fate.delay, packet_at(k, stamp, truth(to_seconds(stamp))));
  }
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::size_t next = 0;
  for (Nanoseconds now = 0; now < 40 * kSecond; now += kMillisecond) {
    while (next < arrivals.size() && arrivals[next].first <= now) {
      receiver->accept(arrivals[next].second, arrivals[next].first);
      ++next;
    }
    const Played<1> played = receiver->play(now);
    if (now < 5 * kSecond) continue;
    const double total = to_seconds(now - played.content_time);
    lowest = std::min(lowest, total);
    highest = std::max(highest, total);
    worst = std::max(worst, std::abs(played.motion.x[0] - truth(to_seconds(now) - total)));
  }
  *spread_of_offset = from_seconds(highest - lowest);
  return worst;
}

TEST(Receiver, SineThroughHeavyJitterFollowsTheDelayedTruth) {
  Nanoseconds wander = 0;
  const double uniform = worst_ripple({.delay_s = 0.1, .jitter_s = 0.05, .loss = 0.01}, &wander);
  std::printf("uniform +-50 %%: worst %.4f mrad, delay wanders %.3f ms\n", 1e3 * uniform, 1e3 * to_seconds(wander));
  // Across g missing packets the chord is off by a (g + 1)^2 dt^2 / 8 with a = 7.9 rad/s^2: 0.1 mrad allows 9 in a row.
  EXPECT_LT(uniform, 1e-4);
  EXPECT_LT(wander, kMillisecond);
  const double normal = worst_ripple(
      {.delay_s = 0.1, .jitter_s = 0.02, .distribution = DelayDistribution::kNormal, .loss = 0.01}, &wander);
  std::printf("normal 20 %%:    worst %.4f mrad, delay wanders %.3f ms\n", 1e3 * normal, 1e3 * to_seconds(wander));
  EXPECT_LT(normal, 1e-4);
}

// Over a virtual hour, compared by what is true: a position is its true sending time, so the stamps under test play no
// part.
struct Hour {
  double mean_ms, low_ms, high_ms;
};
Hour hour(const LinkModelParams& link, double offset_s, double skew_ppm) {
  const auto receiver = make_receiver();
  // Ticks of equal clocks half a period apart: skew sweeps the phase through all of a period.
  const Path path{.link = link, .offset_s = offset_s, .skew_ppm = skew_ppm, .sender_phase = kMillisecond / 2};
  double sum = 0, low = 1e9, high = 0;
  std::int64_t n = 0;
  const auto counters = path.run(3600 * kSecond, *receiver, [&](Nanoseconds now, const Played<1>& played) {
    if (now < 20 * kSecond) return;
    const double total = to_seconds(now) - played.motion.x[0];
    sum += total;
    low = std::min(low, total);
    high = std::max(high, total);
    ++n;
  });
  EXPECT_EQ(counters.rejected_expired, 0u);
  std::printf("offset %g s, skew %g ppm: %.3f .. %.3f ms, mean %.3f; late %llu, lost %llu\n", offset_s, skew_ppm,
              1e3 * low, 1e3 * high, 1e3 * sum / static_cast<double>(n), static_cast<unsigned long long>(counters.late),
              static_cast<unsigned long long>(counters.lost));
  return {1e3 * sum / static_cast<double>(n), 1e3 * low, 1e3 * high};
}

TEST(Receiver, ForeignClocksChangeNothingOverAnHour) {
  const LinkModelParams constant{.delay_s = 0.1, .distribution = DelayDistribution::kConstant};
  const LinkModelParams uniform{.delay_s = 0.1, .jitter_s = 0.05, .loss = 0.01};
  const LinkModelParams normal{
      .delay_s = 0.1, .jitter_s = 0.02, .distribution = DelayDistribution::kNormal, .loss = 0.01};
  for (const LinkModelParams& link : {constant, uniform, normal}) {
    const Hour same = hour(link, 0, 0);
    for (const double skew_ppm : {200.0, -200.0}) {
      const Hour other = hour(link, -skew_ppm * 5e3, skew_ppm);  // -+1e6 s
      // Half the window of the play-out trails the skew by 0.4 ms, its slow slew by as much again.
      EXPECT_NEAR(other.mean_ms, same.mean_ms, 0.8);
      EXPECT_NEAR(other.low_ms, same.low_ms, 2.0);
      EXPECT_NEAR(other.high_ms, same.high_ms, 2.0);
    }
  }
}

TEST(Receiver, TimeIsNeverWarpedByMoreThanStated) {
  for (const auto distribution : {DelayDistribution::kUniform, DelayDistribution::kNormal}) {
    const auto receiver = make_receiver();
    const Path path{.link = {.delay_s = 0.1, .jitter_s = 0.02, .distribution = distribution}, .skew_ppm = 200};
    Nanoseconds previous = 0;
    int held = 0;
    path.run(60 * kSecond, *receiver, [&](Nanoseconds now, const Played<1>& played) {
      const Nanoseconds step = played.content_time - previous;
      previous = played.content_time;
      held += played.held;
      if (now < 1200 * kMillisecond) return;
      EXPECT_LE(step, kMillisecond * 101 / 100 + 1);
      EXPECT_GE(step, kMillisecond * 95 / 100 - 1);
    });
    EXPECT_LT(held, 200);  // in the first second only
  }
}

TEST(Receiver, FollowsADelayThatRisesForGoodAndForgetsASingleSpike) {
  const auto receiver = make_receiver();
  // 20 ms, then 80 ms from 10 s on; one spike of 40 ms at 5 s (the packets behind it queue up).
  const auto delay = [](Nanoseconds t) {
    if (t >= 10 * kSecond) return 80 * kMillisecond;
    if (t >= 5 * kSecond && t < 5 * kSecond + 40 * kMillisecond) return 60 * kMillisecond - (t - 5 * kSecond);
    return 20 * kMillisecond;
  };
  std::uint32_t next = 0;
  for (Nanoseconds now = 0; now < 20 * kSecond; now += kMillisecond) {
    for (; next * kMillisecond + delay(next * kMillisecond) <= now; ++next) {
      receiver->accept(packet_at(next, next * kMillisecond), next * kMillisecond + delay(next * kMillisecond));
    }
    const Played<1> played = receiver->play(now);
    if (now > 6 * kSecond && now < 10 * kSecond) {
      EXPECT_EQ(now - played.content_time, 20 * kMillisecond);
    }
    if (now > 13 * kSecond) {
      EXPECT_EQ(now - played.content_time, 80 * kMillisecond);
      EXPECT_FALSE(played.held);
    }
  }
  EXPECT_EQ(receiver->counters().late, 0u);  // in order: each was shown as the newest
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
