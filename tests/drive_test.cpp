// Scenes on the other drive, and on a device of two joints.
#include <gtest/gtest.h>

#include "common/scene/four_channel.hpp"
#include "tests/bench/plain_step.hpp"
#include "tests/lab/bare_law.hpp"
#include "tests/support/dice.hpp"

namespace farhand {
namespace {

TEST(Scene, ReferencesAreThoseOfTheHandWrittenStep) {
  Dice dice(4);
  Seen seen;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    const SceneParams p = dice.settings();
    FourChannel<ReferenceDrive<1>> scene(p);
    PlainReferenceStep<> plain(p);
    for (int k = 0; k < kTicks; ++k) {
      double in[4];
      dice.next(in);
      const auto [x, x_r, v_r, f_r] = in;
      const ReferenceDrive<1>::Sensed sensed{.x = J1(x), .f = J1(0.1), .valid = true};
      if (!sensed.finite()) continue;  // a station does not look at such readings
      if (k == 0) {
        scene.drive.reset(sensed);
        plain.reset(x);
      }
      const Motion<1> local = scene.drive.observe(sensed, 1);
      const auto command = scene.drive.follow(local, scene.target(local, motion(x_r, v_r, f_r)), true, 1);
      plain.step(x, x_r, v_r, f_r);
      ASSERT_TRUE(command.track);
      ASSERT_NEAR(local.v[0], plain.v, 1e-12);
      ASSERT_NEAR(command.reference.x[0], plain.x_ref, 1e-12);
      ASSERT_NEAR(command.reference.v[0], plain.v_ref, 1e-12);
      ASSERT_NEAR(command.reference.f[0], plain.f_ref, 1e-12);
      ASSERT_EQ(scene.drive.active_limits(), plain.limits);
      seen.add(plain.limits);
    }
  }
  for (const LimitBit bit : {kLimitTorque, kLimitRate, kLimitRange, kLimitVelocity, kLimitNotFinite})
    EXPECT_GT(seen.of(bit), 100) << bit;
}

// Two joints of a scene are two scenes of one joint.
TEST(Scene, JointsDoNotMix) {
  Dice dice(5);
  for (int episode = 0; episode < 20; ++episode) {
    const SceneParams p = dice.settings();
    FourChannelCdobSdcv<DirectDrive<2>> both(p);
    const auto first = make_block_law(Architecture::kCdobSdcv, p), second = make_block_law(Architecture::kCdobSdcv, p);
    Dice other(static_cast<std::uint64_t>(100 + episode));
    for (int k = 0; k < kTicks; ++k) {
      double a[4], b[4];
      if (dice.next(a) || other.next(b)) continue;
      const Motion<2> received{{a[1], b[1]}, {a[2], b[2]}, {a[3], b[3]}};
      const auto one = [&](auto& law, const double(&in)[4]) {
        law->observe(in[0]);
        return law->follow({in[1], in[2], in[3]});
      };
      const Motion<2> local = both.drive.observe({.x = {a[0], b[0]}}, 1);
      const Joints<2> torque = both.drive.follow(local, both.target(local, received), true, 1).torque;
      ASSERT_NEAR(torque[0], one(first, a), 1e-12);
      ASSERT_NEAR(torque[1], one(second, b), 1e-12);
    }
  }
}

}  // namespace
}  // namespace farhand
