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
[[maybe_unused]] double unit(std::uint64_t& seed) { return static_cast<double>(split_mix(seed) >> 11) * 0x1p-53; }

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

}  // namespace
}  // namespace farhand
