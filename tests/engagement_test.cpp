// The state machine and the blend: nothing moves at start, engaging needs an act, nothing jumps.
#include "common/scene/engagement.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/scene/blend.hpp"

namespace farhand {
namespace {

using S = StationState;
using J1 = Joints<1>;

EngagementInputs peer(S state, OperatorAct act = OperatorAct::kNone, bool aligned = false) {
  EngagementInputs in;
  in.peer_alive = true;
  in.peer = state;
  in.act = act;
  in.aligned = aligned;
  return in;
}

TEST(Engagement, LeaderAlignsOnlyByAnAct) {
  Engagement leader(Role::kLeader, {});
  for (int k = 0; k < 100; ++k) EXPECT_EQ(leader.step(k, peer(S::kReady, OperatorAct::kNone, true)), S::kReady);
  EXPECT_EQ(leader.step(100, peer(S::kReady, OperatorAct::kEngage)), S::kAligning);
  EXPECT_EQ(leader.step(101, peer(S::kReady)), S::kAligning);
  EXPECT_EQ(leader.step(102, peer(S::kReady, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, LeaderIgnoresTheActWithoutALivePeer) {
  Engagement leader(Role::kLeader, {});
  EngagementInputs in;
  in.act = OperatorAct::kEngage;
  EXPECT_EQ(leader.step(1, in), S::kReady);
  EXPECT_EQ(leader.step(2, peer(S::kFault, OperatorAct::kEngage)), S::kReady);
}

TEST(Engagement, LeaderGivesUpAligningAndWaitingAfterTheTimeout) {
  Engagement leader(Role::kLeader, {.timeout = 1000});
  leader.step(0, peer(S::kReady, OperatorAct::kEngage));
  EXPECT_EQ(leader.step(1000, peer(S::kReady)), S::kAligning);
  EXPECT_EQ(leader.step(1001, peer(S::kReady)), S::kHolding);
  leader.step(1002, peer(S::kReady, OperatorAct::kEngage));
  EXPECT_EQ(leader.step(1003, peer(S::kReady, OperatorAct::kNone, true)), S::kEngaged);
  EXPECT_EQ(leader.step(2003, peer(S::kReady)), S::kEngaged);
  EXPECT_EQ(leader.step(2004, peer(S::kReady)), S::kHolding);
  EXPECT_EQ(leader.reason(), Reason::kTimeout);
}

TEST(Engagement, LeaderHoldsWhenTheFollowerLetsGo) {
  Engagement leader(Role::kLeader, {});
  leader.step(0, peer(S::kReady, OperatorAct::kEngage));
  leader.step(1, peer(S::kReady, OperatorAct::kNone, true));
  EXPECT_EQ(leader.step(2, peer(S::kReady)), S::kEngaged);  // the follower has not heard of it yet
  EXPECT_EQ(leader.step(3, peer(S::kEngaged)), S::kEngaged);
  EXPECT_EQ(leader.step(4, peer(S::kHolding)), S::kHolding);
  EXPECT_EQ(leader.reason(), Reason::kPeerLetGo);
}

TEST(Engagement, FollowerEngagesOnTheEdgeOnly) {
  Engagement follower(Role::kFollower, {});
  for (int k = 0; k < 50; ++k) EXPECT_EQ(follower.step(k, peer(S::kEngaged, OperatorAct::kNone, true)), S::kReady);
  follower.step(50, peer(S::kAligning, OperatorAct::kNone, true));
  EXPECT_EQ(follower.step(51, peer(S::kEngaged, OperatorAct::kNone, false)), S::kReady);
  EXPECT_EQ(follower.step(52, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, AResumedStreamDoesNotTakeTheHandBack) {
  Engagement follower(Role::kFollower, {});
  follower.step(0, peer(S::kAligning, OperatorAct::kNone, true));
  ASSERT_EQ(follower.step(1, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
  EngagementInputs silent;
  ASSERT_EQ(follower.step(2, silent), S::kHolding);
  EXPECT_EQ(follower.reason(), Reason::kPeerSilent);
  for (int k = 3; k < 100; ++k) EXPECT_EQ(follower.step(k, peer(S::kEngaged, OperatorAct::kNone, true)), S::kHolding);
  follower.step(100, peer(S::kHolding, OperatorAct::kNone, true));
  EXPECT_EQ(follower.step(101, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, FollowerNeverEngagesByItsOwnAct) {
  Engagement follower(Role::kFollower, {});
  EXPECT_EQ(follower.step(0, peer(S::kReady, OperatorAct::kEngage, true)), S::kReady);
}

// A million random inputs for each role.
TEST(Engagement, InvariantsHoldOnRandomSequences) {
  for (const Role role : {Role::kLeader, Role::kFollower}) {
    std::mt19937_64 random(3);
    Engagement machine(role, {.timeout = 40});
    S last = machine.state();
    bool disengaged_since = false;
    for (int k = 0; k < 1'000'000; ++k) {
      const std::uint64_t r = random();
      EngagementInputs in;
      in.act = (r & 7) == 0 ? static_cast<OperatorAct>((r >> 3) % 5) : OperatorAct::kNone;
      in.device_valid = ((r >> 8) & 63) != 0;
      in.finite = ((r >> 16) & 255) != 0;
      in.peer_alive = ((r >> 24) & 15) != 0;
      in.peer = static_cast<S>((r >> 32) % 5);
      in.aligned = ((r >> 40) & 1) != 0;
      if (in.peer_alive && in.peer != S::kEngaged) disengaged_since = true;
      const S now = machine.step(k, in);
      if (last == S::kFault && now != last) {
        ASSERT_EQ(in.act, OperatorAct::kReset);
      }
      if (!in.finite) {
        ASSERT_TRUE(now == S::kFault || last == S::kFault);
      }
      if (now == S::kEngaged && last != now) {
        ASSERT_TRUE(in.peer_alive && in.aligned && in.device_valid && in.finite);
        ASSERT_EQ(last == S::kAligning, role == Role::kLeader);
        if (role == Role::kFollower) {
          ASSERT_TRUE(disengaged_since);
        }
      }
      if (now == S::kAligning && last != now) {
        ASSERT_TRUE(role == Role::kLeader && in.act == OperatorAct::kEngage);
      }
      if (now == S::kEngaged) {
        ASSERT_TRUE(in.peer_alive && in.device_valid);
      }
      if (role == Role::kFollower && now == S::kEngaged) {
        ASSERT_EQ(in.peer, S::kEngaged);
      }
      if (now != last) disengaged_since = false;
      last = now;
    }
  }
}

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
