// A peer that has the right key and is mad: what it does to the person at this side, by that person's true motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/scripted_peer.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using S = StationState;

bool driven(S state) { return state == S::kAligning || state == S::kEngaged || state == S::kHolding; }

std::string hand(double stiffness) { return "slave.hand={stiffness_nm_per_rad: " + std::to_string(stiffness) + "}"; }
const std::string kStill = "master.therapist.intended[0]={duration_s: 100}";

// Whatever it said last, Holding is a spring around where the person was when it fell silent.
TEST(MadPeer, FromEightTenthsOfASecondAfterItsLastWordNothingPressesOn) {
  struct Word {
    double x, f;
  };
  for (const char* scene : {"four_channel", "four_channel_cdob", "sea_four_channel"}) {
    for (const bool patient : {true, false}) {
      for (const Word& word : {Word{0.2, -0.5}, {3.2, -3}, {20, -3}, {1e6, -3}, {-1e300, 1e300}, {0.3, -1e6}}) {
        ScriptedPeer peer(scene, {hand(5), kStill}, patient);
        peer.until(2.0);
        ASSERT_EQ(peer.side().trace().state, S::kEngaged) << scene << ' ' << patient;
        peer.until(2.5, [&](Packet<1>& packet, const Side&, double) {
          packet.motion.x[0] = word.x;
          packet.motion.f[0] = word.f;
          return true;
        });
        const auto silent = [](Packet<1>&, const Side&, double) { return false; };
        double x_hold = 0;
        while (peer.t_s() < 4.5) {
          const S before = peer.side().trace().state;
          peer.tick(silent);
          if (before != S::kHolding) x_hold = peer.side().trace().local.x[0];
          if (peer.t_s() < 2.5 + 0.8) continue;
          ASSERT_EQ(peer.side().trace().state, S::kHolding);
          const scene::Control& control = peer.scene().control();
          const double spring = control.k_p_per_s2() / control.k_f_per_kgm2();
          const Truth truth = peer.side().truth();
          ASSERT_LE(std::abs(truth.f), spring * std::abs(x_hold - truth.x) + 0.1)
              << scene << ' ' << patient << " said " << word.x << ' ' << word.f << " at " << peer.t_s();
        }
      }
    }
  }
}

// A few peers that push along with the motion, turn at its ends or shake; the search of farhand-lab has the rest.
struct Most {
  double speed = 0, power = 0, angle = 0, torque = 0;
};
Most of_pushes(ScriptedPeer peer, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  const double with_v = uniform(bits, -1, 1), with_x = uniform(bits, -3, 3), shakes = uniform(bits, 0, 1),
               hz = log_uniform(bits, 0.3, 20), size = log_uniform(bits, 0.1, 1e6), quiet = uniform(bits, 0, 1);
  Most most;
  peer.until(2.0);
  while (peer.t_s() < 5.0) {
    peer.tick([&](Packet<1>& packet, const Side& side, double t_s) {
      const Truth truth = side.truth();
      const double push = with_v * truth.v + with_x * truth.x + shakes * std::sin(2 * M_PI * hz * t_s) >= 0 ? 1 : -1;
      packet.motion.x[0] = push * size;
      packet.motion.v[0] = push * size;
      packet.motion.f[0] = std::fmod(t_s, 0.3) < 0.3 * quiet ? 0.0 : -push * size;
      return true;
    });
    const Truth truth = peer.side().truth();
    if (!driven(peer.side().trace().state)) continue;
    most.speed = std::max(most.speed, std::abs(truth.v));
    most.power = std::max(most.power, truth.f * truth.v);
    most.angle = std::max(most.angle, std::abs(truth.x));
    most.torque = std::max(most.torque, std::abs(truth.f));
  }
  return most;
}

TEST(MadPeer, ADirectDriveKeepsItsLimitsAtTheHand) {
  for (const double K : {0.5, 2.0, 5.0, 20.0}) {
    Most all;
    for (const char* J : {"0.0028", "0.004", "0.006"}) {
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Most most =
            of_pushes(ScriptedPeer("four_channel", {hand(K), std::string("slave.motor.J_kgm2=") + J}, true), seed);
        all = {std::max(all.speed, most.speed), std::max(all.power, most.power), std::max(all.angle, most.angle),
               std::max(all.torque, most.torque)};
      }
    }
    std::printf("hand of %.1f N m/rad: %.2f rad/s, %.2f W, %.3f rad, %.2f N m\n", K, all.speed, all.power, all.angle,
                all.torque);
    EXPECT_LE(all.speed, 1.1 * 4);
    EXPECT_LE(all.power, (K > 5 ? 1.5 : 1.1) * 2);
    EXPECT_LE(all.angle, 0.349 + 0.0175);
    EXPECT_LE(all.torque, 3.05 + all.speed * std::sqrt(0.006 * K));
    EXPECT_GT(all.speed, 1.5);  // they did push
  }
}

TEST(MadPeer, ATherapistWhoHoldsStillIsMovedWithinHisLimits) {
  for (const char* grip : {"LIGHT", "NORMAL", "FIRM"}) {
    for (const char* scene : {"four_channel", "four_channel_cdob", "two_channel"}) {
      Most all;
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Most most =
            of_pushes(ScriptedPeer(scene, {std::string("master.therapist.grip=") + grip, kStill}, false), seed);
        all = {std::max(all.speed, most.speed), std::max(all.power, most.power), std::max(all.angle, most.angle),
               std::max(all.torque, most.torque)};
      }
      std::printf("%s, %s: %.2f rad/s, %.2f W, %.3f rad, %.2f N m\n", grip, scene, all.speed, all.power, all.angle,
                  all.torque);
      EXPECT_LE(all.speed, 1.1 * 4);
      EXPECT_LE(all.power, 1.1 * 2);
      EXPECT_LE(all.torque, 3 + 0.1);
      EXPECT_GT(all.speed, 1.0);
    }
  }
}

// Faster than anybody moves on purpose, and never near a limit of speed or power.
TEST(MadPeer, ATherapistWhoIsShakenIsHeld) {
  for (const double hz : {6.0, 9.0, 14.0}) {
    ScriptedPeer peer("four_channel", {"master.therapist.grip=LIGHT", kStill}, false);
    double quiet = 1e9;
    while (peer.t_s() < 8.0) {
      peer.tick([&](Packet<1>& packet, const Side&, double t_s) {
        if (t_s > 3) packet.motion.f[0] = 0.4 * std::sin(2 * M_PI * hz * t_s);
        return true;
      });
      if (peer.side().trace().state == S::kHolding) quiet = std::min(quiet, peer.t_s());
    }
    std::printf("%.0f Hz: held after %.2f s\n", hz, quiet - 3);
    EXPECT_LT(quiet, 3 + 4);  // a second of variance, two between the limit and its half, and what it takes to grow
  }
}

// The guard slows what the device does. From a peer that says nothing but that it is there, it takes no digit.
TEST(MadPeer, WhatTheTherapistDoesHimselfIsTheSameToTheDigitWithAndWithoutGuard) {
  for (const char* grip : {"LIGHT", "NORMAL", "FIRM"}) {
    const std::vector<std::string> moves = {
        std::string("master.therapist.grip=") + grip, "master.therapist.intended[0]={duration_s: 3}",
        "master.therapist.intended[1]={duration_s: 100 sine_amplitude_rad: 0.3 sine_frequency_hz: 2.2}"};
    std::vector<std::string> free = moves;
    free.push_back("master.limits.power_w=1000");
    free.push_back("master.axis.velocity_limit_rad_s=1000");
    ScriptedPeer guarded("four_channel", moves, false), unguarded("four_channel", free, false);
    // Follows him as far as its own limits go, somewhat slower, and gives no torque: nothing that it says speeds him
    // up.
    const auto echo = [](Packet<1>& packet, const Side& side, double) {
      packet.motion.x = side.trace().remote.x + (side.trace().local.x - side.trace().remote.x).max(-4e-3).min(4e-3);
      packet.motion.v = (0.9 * side.trace().local.v).max(-4.0).min(4.0);
      return true;
    };
    double fastest = 0;
    while (guarded.t_s() < 8.0) {
      guarded.tick(echo);
      unguarded.tick(echo);
      ASSERT_EQ(guarded.side().truth().f, unguarded.side().truth().f) << grip << ' ' << guarded.t_s();
      fastest = std::max(fastest, std::abs(guarded.side().truth().v));
    }
    EXPECT_EQ(guarded.side().trace().state, S::kEngaged);
    std::printf("%s: %.2f rad/s by himself\n", grip, fastest);
  }
}

}  // namespace
}  // namespace farhand
