// What the receiver shows, and when, through links with jitter, loss, foreign clocks and delays that change.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/support/receiver_path.hpp"

namespace farhand {
namespace {

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

}  // namespace
}  // namespace farhand
