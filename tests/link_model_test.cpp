// The link model against what it was asked for. Bounds are 5 standard errors of the estimate: a true model fails once
// in 2 million draws of the seed, and the seeds are fixed.
#include "netem/link_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "netem/pending.hpp"

namespace farhand {
namespace {

constexpr int kDraws = 200000;

struct Sample {
  std::vector<double> delay_s;
  int lost = 0;
  double mean() const {
    double sum = 0;
    for (const double d : delay_s) sum += d;
    return sum / static_cast<double>(delay_s.size());
  }
  double deviation() const {
    double sum = 0;
    const double m = mean();
    for (const double d : delay_s) sum += (d - m) * (d - m);
    return std::sqrt(sum / static_cast<double>(delay_s.size()));
  }
  double share_below(double x) const {
    return static_cast<double>(std::count_if(delay_s.begin(), delay_s.end(), [x](double d) { return d < x; })) / kDraws;
  }
};

Sample draw(const LinkModelParams& params, std::uint64_t seed, LinkDirection direction = LinkDirection::kForward) {
  LinkModel model(params, seed, direction);
  Sample sample;
  for (int i = 0; i < kDraws; ++i) {
    const auto fate = model.offer(i * kMillisecond);
    sample.delay_s.push_back(to_seconds(fate.delay));
    sample.lost += fate.lost;
  }
  return sample;
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

TEST(LinkModel, ConstantDelayIsExact) {
  LinkModel model({.delay_s = 0.1, .jitter_s = 0.05, .distribution = DelayDistribution::kConstant}, 1,
                  LinkDirection::kForward);
  for (int i = 0; i < 1000; ++i) {
    const auto fate = model.offer(i);
    EXPECT_EQ(fate.delay, 100 * kMillisecond);
    EXPECT_FALSE(fate.lost);
  }
}

TEST(LinkModel, UniformDelayHasMeanSpreadAndQuantilesAsAsked) {
  const double mean = 0.1, half = 0.05;
  const Sample sample = draw({.delay_s = mean, .jitter_s = half}, 2);
  const double sigma = half / std::sqrt(3.0);
  EXPECT_NEAR(sample.mean(), mean, 5 * sigma / std::sqrt(kDraws));
  // Var(s^2) = (mu_4 - sigma^4)/n with mu_4 = 9/5 sigma^4.
  EXPECT_NEAR(sample.deviation(), sigma, 5 * 0.5 * sigma * std::sqrt(0.8 / kDraws));
  const auto [low, high] = std::minmax_element(sample.delay_s.begin(), sample.delay_s.end());
  EXPECT_GE(*low, mean - half);
  EXPECT_LE(*high, mean + half);
  // P(no draw within w of an end) = (1 - w/2h)^n < 1e-9 for w = 2h 21/n.
  EXPECT_LE(*low, mean - half + 42 * half / kDraws);
  EXPECT_GE(*high, mean + half - 42 * half / kDraws);
  for (const double p : {0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99}) {
    EXPECT_NEAR(sample.share_below(mean - half + 2 * half * p), p, 5 * std::sqrt(p * (1 - p) / kDraws)) << p;
  }
}

TEST(LinkModel, NormalDelayHasMeanSpreadAndQuantilesAsAsked) {
  const double mean = 0.1, sigma = 0.01;  // cut at zero 10 sigma away: never
  const Sample sample = draw({.delay_s = mean, .jitter_s = sigma, .distribution = DelayDistribution::kNormal}, 3);
  EXPECT_NEAR(sample.mean(), mean, 5 * sigma / std::sqrt(kDraws));
  EXPECT_NEAR(sample.deviation(), sigma, 5 * sigma / std::sqrt(2.0 * kDraws));
  for (const double z : {-3.5, -2.0, -1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 3.5}) {
    const double p = normal_cdf(z);
    EXPECT_NEAR(sample.share_below(mean + z * sigma), p, 5 * std::sqrt(p * (1 - p) / kDraws)) << z;
  }
}

TEST(LinkModel, DelayIsNeverNegativeAndTheCutPartIsZero) {
  const Sample normal = draw({.delay_s = 0.1, .jitter_s = 0.1, .distribution = DelayDistribution::kNormal}, 4);
  EXPECT_GE(*std::min_element(normal.delay_s.begin(), normal.delay_s.end()), 0.0);
  const double p = normal_cdf(-1.0);
  EXPECT_NEAR(normal.share_below(1e-12), p, 5 * std::sqrt(p * (1 - p) / kDraws));
  const Sample uniform = draw({.delay_s = 0.01, .jitter_s = 0.03}, 5);
  EXPECT_GE(*std::min_element(uniform.delay_s.begin(), uniform.delay_s.end()), 0.0);
}

TEST(LinkModel, LossRateIsAsAsked) {
  for (const double p : {0.0, 0.01, 0.2, 1.0}) {
    EXPECT_NEAR(draw({.loss = p}, 6).lost, p * kDraws, 5 * std::sqrt(p * (1 - p) * kDraws)) << p;
  }
}

TEST(LinkModel, CutLosesEverythingAndNothingElse) {
  LinkModel model({.delay_s = 0.1, .cut_from_s = 2.0, .cut_until_s = 3.0}, 7, LinkDirection::kForward);
  for (int i = 0; i < 5000; ++i) EXPECT_EQ(model.offer(i * kMillisecond).lost, i >= 2000 && i < 3000) << i;
}

TEST(LinkModel, SameSeedAndDirectionRepeatOtherwiseNothingDoes) {
  const LinkModelParams params{.delay_s = 0.1, .jitter_s = 0.05};
  const Sample a = draw(params, 8), again = draw(params, 8), back = draw(params, 8, LinkDirection::kBackward),
               other = draw(params, 9);
  EXPECT_EQ(a.delay_s, again.delay_s);
  const auto correlation = [](const Sample& u, const Sample& v, std::size_t shift) {
    const double u_mean = u.mean(), v_mean = v.mean();
    double sum = 0;
    for (std::size_t i = shift; i < kDraws; ++i) sum += (u.delay_s[i] - u_mean) * (v.delay_s[i - shift] - v_mean);
    return sum / kDraws / (u.deviation() * v.deviation());
  };
  const double bound = 5 / std::sqrt(kDraws);
  EXPECT_NEAR(correlation(a, back, 0), 0.0, bound);
  EXPECT_NEAR(correlation(a, other, 0), 0.0, bound);
  EXPECT_NEAR(correlation(a, a, 1), 0.0, bound);  // neighbours within one stream
}

TEST(LinkModel, LossAndCutDoNotChangeTheDelaysOfTheOthers) {
  const Sample a = draw({.delay_s = 0.1, .jitter_s = 0.05}, 10);
  const Sample b = draw({.delay_s = 0.1, .jitter_s = 0.05, .loss = 0.3, .cut_from_s = 1.0, .cut_until_s = 2.0}, 10);
  EXPECT_EQ(a.delay_s, b.delay_s);
}

TEST(LinkModel, RefusesWhatNoLinkHas) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const LinkModelParams& bad :
       {LinkModelParams{.delay_s = -0.1}, LinkModelParams{.delay_s = nan}, LinkModelParams{.jitter_s = -1},
        LinkModelParams{.jitter_s = nan}, LinkModelParams{.loss = 1.1}, LinkModelParams{.loss = nan}}) {
    EXPECT_THROW(LinkModel(bad, 1, LinkDirection::kForward), std::invalid_argument);
  }
}

TEST(PendingDatagrams, LeaveInTheOrderOfDueTimeThenOfArrival) {
  PendingDatagrams pending(1000);
  std::uint64_t seed = 11;
  std::vector<std::pair<Nanoseconds, std::uint16_t>> expected;
  for (std::uint16_t i = 0; i < 1000; ++i) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    const Nanoseconds due = static_cast<Nanoseconds>(seed >> 58);  // 64 moments: many ties
    ASSERT_TRUE(pending.push(due, std::as_bytes(std::span(&i, 1))));
    expected.emplace_back(due, i);
  }
  std::stable_sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [due, i] : expected) {
    ASSERT_FALSE(pending.empty());
    EXPECT_EQ(pending.due(), due);
    const auto bytes = pending.pop();
    ASSERT_EQ(bytes.size(), sizeof i);
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), std::as_bytes(std::span(&i, 1)).begin()));
  }
  EXPECT_TRUE(pending.empty());
}

TEST(PendingDatagrams, AreBoundedInNumberAndSize) {
  PendingDatagrams pending(2);
  const std::array<std::byte, PendingDatagrams::kMaxBytes + 1> bytes{};
  EXPECT_FALSE(pending.push(0, bytes));
  EXPECT_TRUE(pending.push(0, std::span(bytes).first(256)));
  EXPECT_TRUE(pending.push(0, {}));
  EXPECT_FALSE(pending.push(0, {}));
  EXPECT_EQ(pending.size(), 2u);
  EXPECT_EQ(pending.pop().size(), 256u);
  EXPECT_TRUE(pending.push(0, {}));
}

}  // namespace
}  // namespace farhand
