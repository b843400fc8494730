// Gaps of the network in whole sessions in virtual time: how often and how soon both sides go on, and what the persons
// feel of it. And a box whose peer is mad.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/support/gap_session.hpp"
#include "tests/support/scripted_peer.hpp"

namespace farhand {
namespace {

using S = StationState;

GapCell cell_of(int situation, bool elastic, std::uint64_t seed) {
  std::mt19937_64 bits(1000 * seed + 10 * static_cast<std::uint64_t>(situation) + (elastic ? 1 : 0));
  GapCell cell{.situation = situation, .elastic = elastic, .seed = seed};
  cell.gap_s = uniform(bits, 0, 1) < 0.75 ? uniform(bits, 0.05, 0.5) : uniform(bits, 0.5, 2.0);
  cell.delay_s = log_uniform(bits, 0.005, 0.1);
  cell.jitter_s = cell.delay_s * uniform(bits, 0, 0.5);
  const double ways = uniform(bits, 0, 1);
  cell.forward = ways > 0.15;
  cell.backward = ways < 0.85;
  constexpr const char* kGrips[] = {"LIGHT", "NORMAL", "FIRM"};
  constexpr const char* kArchitectures[] = {"MODEL_MEDIATED", "MODEL_MEDIATED", "FOUR_CHANNEL_CDOB",
                                            "FOUR_CHANNEL_CDOB_SDCV", "WAVE"};
  cell.grip = kGrips[static_cast<int>(uniform(bits, 0, 3))];
  cell.architecture = kArchitectures[static_cast<int>(uniform(bits, 0, 5))];
  return cell;
}

// Gaps that are sure to be shorter than 0.5 s at both sides, or longer.
void expect_resumed(int seeds) {
  int all_should = 0, all_did = 0, all_long = 0, unnoticed = 0, moved = 0;
  double jump = 0, more = -10, more_moved = -10, more_engaged = -10, latest = 0;
  for (int situation = 0; situation < kSituationCount; ++situation) {
    for (const bool elastic : {false, true}) {
      int should = 0, did = 0, anyway = 0;
      double slowest = 0;
      for (int seed = 1; seed <= seeds; ++seed) {
        const GapCell cell = cell_of(situation, elastic, static_cast<std::uint64_t>(seed));
        const AfterTheGap after = after_the_gap(cell);
        if (!after.engaged_before) continue;
        const double more_or_less = 2 * cell.jitter_s + 3e-3;
        if (!after.held) {
          ++unnoticed;
          EXPECT_LT(cell.gap_s, 0.1 + more_or_less) << cell.text();
          continue;
        }
        if (cell.gap_s > 0.5 + more_or_less) {
          ++all_long;
          EXPECT_LT(after.resumed_s, 0) << cell.text();
          continue;
        }
        if (cell.gap_s > 0.5 - more_or_less) continue;
        if (after.resumed_s >= 0) {
          jump = std::max(jump, after.jump_rad);
          (after.stayed ? more : more_moved) = std::max(after.stayed ? more : more_moved, after.more_nm);
          more_engaged = std::max(more_engaged, after.more_engaged_nm);
          if (after.jump_rad > 1e-3 || after.more_nm > 0.1)
            std::printf("  %.2f mrad, %+.3f N m (%s)%s: %s\n", 1e3 * after.jump_rad, after.more_nm,
                        (after.more_at + ", " + after.jump_at).c_str(), after.stayed ? "" : ", moved",
                        cell.text().c_str());
        }
        const bool in_time = after.resumed_s >= 0 && after.resumed_s <= 0.5;
        if (!after.stayed) {
          ++moved;
          anyway += in_time ? 1 : 0;
          continue;
        }
        ++should;
        did += in_time ? 1 : 0;
        slowest = std::max(slowest, after.resumed_s);
        if (!in_time) std::printf("  resumed after %.3f s: %s\n", after.resumed_s, cell.text().c_str());
      }
      std::printf("%-20s %-6s %3d of %3d resumed within 0.5 s, the last after %.3f s; %d who moved\n",
                  kSituations[situation], elastic ? "MCU" : "direct", did, should, slowest, anyway);
      all_should += should;
      all_did += did;
      latest = std::max(latest, slowest);
    }
  }
  std::printf("%d of %d resumed within 0.5 s; %d moved, %d longer gaps, %d not noticed; jump %.3f mrad\n", all_did,
              all_should, moved, all_long, unnoticed, 1e3 * jump);
  std::printf("%+.3f N m above Holding in the first 0.1 s (%+.3f for who moved; %+.3f in that of Engaged)\n", more,
              more_moved, more_engaged);
  EXPECT_GT(all_should, seeds * kSituationCount / 4);
  EXPECT_GT(all_long, 0);
  EXPECT_GE(all_did, 0.95 * all_should);
  EXPECT_LE(jump, 1e-3);
  EXPECT_LE(more, 0.1);
}

TEST(Resume, EndsAGapFromHoldingWhereBothStayed) { expect_resumed(12); }
TEST(NightlyResume, TwoHundredSeedsOfEverySituation) { expect_resumed(200); }

// A peer that has the key and lies: it falls silent again and again, and says that it holds, aligns and resumes. The
// box counts for itself.
TEST(ResumesForAMadPeer, ThreeTimesAMinuteWhateverItSays) {
  for (const char* scene : {"four_channel", "sea_four_channel"}) {
    for (const int silent_ms : {0, 110, 180, 450}) {
      for (const std::uint32_t aligning : {0u, 1u}) {
        ScriptedPeer peer(scene, {"master.therapist.intended[0]={duration_s: 100}"}, true);
        peer.until(2.0);
        ASSERT_EQ(peer.side().trace().state, S::kEngaged);
        std::vector<double> resumed;
        S before = S::kEngaged;
        while (peer.t_s() < 130) {
          peer.tick([&](Packet<1>& packet, const Side& side, double t_s) {
            const double beat = std::fmod(t_s - 2.0, 0.8);
            if (beat < 1e-3 * silent_ms) return false;
            const bool holds = beat < 1e-3 * silent_ms + 0.1;
            packet.state = !holds ? S::kEngaged : aligning != 0 ? S::kAligning : S::kHolding;
            packet.limits = kGapHeld | kGapOver;
            packet.motion.x = side.trace().local.x;
            return true;
          });
          const TickTrace<1>& trace = peer.side().trace();
          if (trace.state != before && trace.state == S::kEngaged) {
            EXPECT_EQ(trace.reason, Reason::kResumed) << "what says that it resumes is taken for no operator's act";
            resumed.push_back(peer.t_s());
          }
          before = trace.state;
        }
        EXPECT_GE(resumed.size(), 3u);
        for (std::size_t k = 3; k < resumed.size(); ++k) EXPECT_GT(resumed[k] - resumed[k - 3], 60.0) << scene;
      }
    }
  }
}

// Behind a lie there is no hand that is far away or fast.
TEST(ResumesForAMadPeer, OnlyNearAndSlow) {
  struct Said {
    double x, v;
    bool resumes;
  };
  for (const Said& said :
       {Said{0.0, 0.0, true}, {0.08, 0.0, true}, {0.1, 0.0, false}, {-0.1, 0.0, false}, {0.0, 0.4, false}}) {
    ScriptedPeer peer("four_channel", {"master.therapist.intended[0]={duration_s: 100}"}, true);
    peer.until(2.0);
    ASSERT_EQ(peer.side().trace().state, S::kEngaged);
    const double x = peer.side().trace().local.x[0];
    while (peer.t_s() < 6.0) {
      peer.tick([&](Packet<1>& packet, const Side&, double t_s) {
        if (t_s < 2.2) return false;
        packet.state = t_s < 2.25 ? S::kHolding : S::kEngaged;
        packet.limits = kGapHeld | kGapOver;
        packet.motion.x[0] = x + said.x;
        packet.motion.v[0] = said.v;
        return true;
      });
      ASSERT_TRUE(peer.side().trace().state != S::kEngaged || said.resumes || peer.t_s() < 2.2)
          << said.x << ' ' << said.v;
    }
    EXPECT_EQ(peer.side().trace().state == S::kEngaged, said.resumes) << said.x << ' ' << said.v;
  }
}

}  // namespace
}  // namespace farhand
