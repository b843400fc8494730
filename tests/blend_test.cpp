// The blend: a change of source is no jump, and position and velocity stay one motion.
#include "common/station/blend.hpp"

#include <gtest/gtest.h>

#include <random>

namespace farhand {
namespace {

using J1 = Joints<1>;

TEST(Blend, IsContinuousAcrossEverySwitchAndEndsAtTheSource) {
  std::mt19937_64 random(5);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  const auto any = [&] { return Motion<1>{J1(uniform(-.5, .5)), J1(uniform(-1, 1)), J1(uniform(-2, 2))}; };
  Blend<1> blend(0.5, 0.3);
  Motion<1> last = blend.step({}, 1e-3);
  for (int round = 0; round < 10'000; ++round) {
    const Motion<1> source = any();
    blend.begin(last, source);
    const Motion<1> first = blend.step(source, 0.0);
    ASSERT_NEAR(first.x[0], last.x[0], 1e-15);
    ASSERT_NEAR(first.v[0], last.v[0], 1e-15);
    ASSERT_NEAR(first.f[0], last.f[0], 1e-15);
    const int steps = static_cast<int>(random() % 5000);
    Motion<1> now = first;
    for (int k = 0; k < steps; ++k) {
      const Motion<1> next = blend.step(source, 1e-3);
      ASSERT_LE(std::abs(next.x[0] - now.x[0]),
                1.5 * 1e-3 * std::max(0.3, std::abs(last.x[0] - source.x[0]) / 0.5) + 1e-12);
      now = next;
    }
    if (blend.done()) {
      ASSERT_EQ(now.x[0], source.x[0]);
      ASSERT_EQ(now.v[0], source.v[0]);
      ASSERT_EQ(now.f[0], source.f[0]);
    }
    last = now;
  }
}

// The velocity that it hands out is the slope of the position that it hands out.
TEST(Blend, PositionAndVelocityAreOneMotion) {
  Blend<1> blend(0.5, 0.3);
  const Motion<1> from{J1(0.3), J1(0.0), J1(0.0)}, to{};
  blend.begin(from, to);
  double x = from.x[0];
  for (int k = 0; k < 1000; ++k) {
    const Motion<1> a = blend.step(to, 0.5e-3), b = blend.step(to, 0.5e-3);
    ASSERT_NEAR((b.x[0] - x) / 1e-3, a.v[0], 1e-5);
    x = b.x[0];
  }
}

}  // namespace
}  // namespace farhand
