// Recordings of several processes on one axis of time, and sessions on disk.
#include "common/record/merge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/record/mcap_reader.hpp"
#include "common/record/recording.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

constexpr Nanoseconds kMasterStart = 1'000'000 * kSecond;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

record::RunInfo info_of(const std::string& role, Nanoseconds start, const std::string& clock = "") {
  record::RunInfo info;
  info.set_role(role);
  info.set_scene_name("wall");
  info.set_scene_text("duration_s: 2\n");
  info.set_seed(3);
  info.set_start_ns(start);
  info.set_start_utc_ns(1'800'000'000 * kSecond);
  info.set_clock_id(clock);
  return info;
}

// Both stations for 2 s at 1 kHz; the slave's clock reads master + theta. Delays: a floor per direction plus up to 40
// ms.
struct TwoHosts {
  Nanoseconds theta = 0, floor_forward = 80 * kMillisecond, floor_return = 80 * kMillisecond;
  std::string master_clock = "m", slave_clock = "s";
  bool has_friction = false;  // of the box

  void record(const std::filesystem::path& directory) const {
    std::mt19937_64 random(5);
    const auto delay = [&](Nanoseconds floor) {
      return floor + static_cast<Nanoseconds>(random() % static_cast<std::uint64_t>(40 * kMillisecond));
    };
    Recording master(directory / "master.mcap", info_of("master", kMasterStart, master_clock));
    Recording slave(directory / "slave.mcap", info_of("slave", kMasterStart + theta + 300 * kMillisecond, slave_clock));
    for (int i = 0; i < 2000; ++i) {
      const Nanoseconds t = kMasterStart + i * kMillisecond;
      StationSample sample;
      sample.x_rad = i;
      sample.true_x_rad = sample.true_v_rad_s = sample.true_f_nm = kUnknown;
      if (i > 200) {
        sample.newest_peer_arrival_ns = t;
        sample.newest_peer_send_ns = t - delay(floor_return) + theta;
      }
      master.write(t, sample);
      if (i > 200) {
        sample.newest_peer_arrival_ns = t + theta;
        sample.newest_peer_send_ns = t - delay(floor_forward);
      }
      slave.write(t + theta, sample);
    }
    slave.write(kMasterStart + theta + kSecond, Note("contact"));
    StationCounters counters;
    counters.sent = 1;
    master.finish(counters);
    counters.sent = 2;
    if (has_friction)
      slave.friction(
          {.threshold_nm = 0.05, .measured = true, .F_c_nm = 0.05, .spread_nm = 0.002, .swept_utc_s = 1796117400});
    slave.finish(counters);
  }
};

TEST(Merge, KnowsTheFrictionThatWasInForceAtTheBox) {
  for (const bool has_friction : {true, false}) {
    ScratchDirectory scratch;
    TwoHosts hosts;
    hosts.has_friction = has_friction;
    hosts.record(scratch.path());
    const Session merged = merge_recordings(scratch.path());
    const Session session = read_session_mcap(write_session_mcap(merged, scratch / "session.mcap"));
    for (const DeviceFriction& friction : {merged.friction, session.friction}) {
      if (has_friction) {
        EXPECT_EQ(friction.threshold_nm, 0.05);
        EXPECT_EQ(friction.F_c_nm, 0.05);
        EXPECT_EQ(friction.spread_nm, 0.002);
        EXPECT_EQ(friction.swept_utc_s, 1796117400);
        EXPECT_TRUE(friction.measured);
      } else {
        EXPECT_TRUE(std::isnan(friction.threshold_nm)) << "as in recordings from before";
        EXPECT_TRUE(std::isnan(friction.F_c_nm));
      }
    }
  }
}

TEST(Merge, AlignsTheClocksOfTwoHostsWithinItsBound) {
  for (const Nanoseconds theta : {Nanoseconds{0}, 17 * kMillisecond, -999'999 * kSecond, 1'000'000 * kSecond}) {
    for (const Nanoseconds skewed : {0, 60}) {
      ScratchDirectory scratch;
      TwoHosts hosts;
      hosts.theta = theta;
      hosts.floor_return += skewed * kMillisecond;
      hosts.record(scratch.path());
      const Session session = merge_recordings(scratch.path());
      const double true_offset = -to_seconds(theta);
      EXPECT_LE(std::abs(session.clock_offset_s - true_offset), session.clock_offset_bound_s);
      // What is left is half the asymmetry of the two fastest packets; 1,800 draws over 40 ms come within 0.5 ms of the
      // floor.
      EXPECT_NEAR(session.clock_offset_s - true_offset, to_seconds(skewed * kMillisecond) / 2, 0.5e-3);
      EXPECT_NEAR(session.clock_offset_bound_s, 0.080 + to_seconds(skewed * kMillisecond) / 2, 0.5e-3);
      ASSERT_EQ(session.slave.size(), 2000u);
      EXPECT_NEAR(session.slave[1000].t_s, 1.0 + to_seconds(skewed * kMillisecond) / 2, 0.5e-3);
      EXPECT_EQ(session.slave[1000].x_rad, 1000);
      EXPECT_EQ(session.master[1000].t_s, 1.0);
    }
  }
}

TEST(Merge, TrustsASharedClock) {
  ScratchDirectory scratch;
  TwoHosts hosts;
  hosts.floor_return += 60 * kMillisecond;
  hosts.slave_clock = hosts.master_clock;
  hosts.record(scratch.path());
  const Session session = merge_recordings(scratch.path());
  EXPECT_EQ(session.clock_offset_s, 0);
  EXPECT_EQ(session.clock_offset_bound_s, 0);
  EXPECT_EQ(session.slave[1000].t_s, 1.0);
  EXPECT_EQ(session.master_counters.sent, 1u);
  EXPECT_EQ(session.slave_counters.sent, 2u);
  EXPECT_EQ(session.scene_text, "duration_s: 2\n");
  ASSERT_EQ(session.events.size(), 1u);
  EXPECT_EQ(session.events[0].who, "slave");
  EXPECT_EQ(session.events[0].text, "contact");
  EXPECT_EQ(session.events[0].t_s, 1.0);
}

TEST(Merge, ReadsTheTrueWorldBetweenTheTicksOfTheEmulator) {
  ScratchDirectory scratch;
  TwoHosts hosts;
  hosts.theta = 5 * kSecond;
  hosts.record(scratch.path());
  {
    // 0.3 ms beside the ticks of the slave, from 0.5 s to 1.5 s, with a position that grows by 1 rad/s: linear in
    // between is exact.
    Recording mcu(scratch / "mcu.mcap", info_of("mcu", kMasterStart + hosts.theta));
    for (int i = 0; i < 2000; ++i) {
      const Nanoseconds t = 500 * kMillisecond + 300 * kMicrosecond + i * 500 * kMicrosecond;
      McuSample sample;
      sample.true_x_rad = to_seconds(t);
      sample.true_v_rad_s = 1;
      sample.true_f_nm = -2 * to_seconds(t);
      mcu.write(kMasterStart + hosts.theta + t, sample);
    }
    mcu.finish({});
  }
  const Session session = merge_recordings(scratch.path());
  for (int i = 0; i < 2000; ++i) {
    const StationSample& sample = session.slave[static_cast<std::size_t>(i)];
    if (i <= 500 || i >= 1500) {
      EXPECT_TRUE(std::isnan(sample.true_x_rad)) << i;
    } else {
      EXPECT_NEAR(sample.true_x_rad, i * 1e-3, 1e-12) << i;
      EXPECT_NEAR(sample.true_v_rad_s, 1, 1e-12) << i;
      EXPECT_NEAR(sample.true_f_nm, -2e-3 * i, 1e-12) << i;
    }
  }
}

TEST(Merge, TakesWhatAKilledSideLeft) {
  ScratchDirectory scratch;
  TwoHosts{}.record(scratch.path());
  // As SIGKILL leaves it: no end, a torn chunk.
  const std::string whole = file_bytes(scratch / "slave.mcap");
  write_bytes(scratch / "slave.mcap.part", std::string_view(whole).substr(0, whole.size() / 2));
  std::filesystem::remove(scratch / "slave.mcap");
  const Session session = merge_recordings(scratch.path());
  EXPECT_GT(session.slave.size(), 500u);
  EXPECT_LT(session.slave.size(), 1500u);
  EXPECT_EQ(session.master.size(), 2000u);
  EXPECT_NE(session.events.at(0).text.find("slave.mcap.part: was not closed"), std::string::npos)
      << session.events.at(0).text;
}

TEST(Merge, TakesTheNewestOfARoleAndSaysSo) {
  ScratchDirectory scratch;
  TwoHosts{}.record(scratch.path());
  std::filesystem::rename(scratch / "slave.mcap", scratch / "slave.mcap.part");
  TwoHosts hosts;
  hosts.theta = 5 * kSecond;
  hosts.record(scratch.path());  // master-2.mcap, slave-2.mcap
  ASSERT_TRUE(std::filesystem::exists(scratch / "slave-2.mcap"));
  const Session session = merge_recordings(scratch.path());
  EXPECT_EQ(session.slave.size(), 2000u);
  EXPECT_NEAR(session.clock_offset_s, -5, 0.05);
  EXPECT_EQ(session.events.at(0).text,
            "master-2.mcap was read, the newest of 2 recordings of this side; the one before it is master.mcap");
  EXPECT_EQ(session.events.at(1).text,
            "slave-2.mcap was read, the newest of 2 recordings of this side; the one before it is slave.mcap.part");
}

// Found by a sanitizer: differences and sums of stamps that no clock ever showed.
TEST(Merge, StampsAtTheEndsOfTheirRangeAreNoOverflow) {
  constexpr Nanoseconds kFirst = std::numeric_limits<Nanoseconds>::min(),
                        kLast = std::numeric_limits<Nanoseconds>::max();
  for (const Nanoseconds send : {kFirst, Nanoseconds{-1}, kLast}) {
    for (const Nanoseconds arrival : {kFirst, Nanoseconds{1}, kLast}) {
      ScratchDirectory scratch;
      for (const char* role : {"master", "slave"}) {
        Recording side(scratch / (std::string(role) + ".mcap"), info_of(role, send));
        StationSample sample;
        sample.newest_peer_send_ns = send;
        sample.newest_peer_arrival_ns = arrival;
        side.write(arrival, sample);
        side.write(kFirst, sample);
        side.write(arrival, Note("x"));
        side.finish({});
      }
      const Session session = merge_recordings(scratch.path());
      EXPECT_EQ(session.master.size() + session.slave.size(), 4u);
      for (const StationSample& sample : session.slave) EXPECT_TRUE(std::isfinite(sample.t_s));
      EXPECT_EQ(read_session_mcap(write_session_mcap(session, scratch / "session.mcap")).slave.size(), 2u);
    }
  }
}

TEST(Merge, GoesOnWithOneSideAndSaysSo) {
  ScratchDirectory scratch;
  EXPECT_THROW(merge_recordings(scratch.path()), std::runtime_error);
  TwoHosts{}.record(scratch.path());
  write_bytes(scratch / "slave.mcap", "no recording");
  const Session session = merge_recordings(scratch.path());
  EXPECT_EQ(session.master.size(), 2000u);
  EXPECT_TRUE(session.slave.empty());
  ASSERT_EQ(session.events.size(), 2u);
  EXPECT_NE(session.events[0].text.find("is not an MCAP file"), std::string::npos);
  EXPECT_EQ(session.events[1].text, "there is no recording of this side");
}

// 200 ppm over 1,000 s are 200 ms, ten times the round trip: theta runs from 0 to 0.2 s.
TEST(Merge, BoundsTheOffsetOfClocksThatDrift) {
  constexpr Nanoseconds kDelay = 10 * kMillisecond;
  Recorded::Series<StationSample> master, slave;
  for (int i = 0; i <= 100'000; ++i) {
    const Nanoseconds t = i * 10 * kMillisecond, theta = i * 2 * kMicrosecond;
    StationSample sample;
    sample.rtt_s = 0.020;
    sample.newest_peer_arrival_ns = t + kDelay + 1;  // 1: the stamp 0 means none
    sample.newest_peer_send_ns = t + theta + 1;
    master.emplace_back(t, sample);
    sample.newest_peer_arrival_ns = t + kDelay + theta + 1;
    sample.newest_peer_send_ns = t + 1;
    slave.emplace_back(t, sample);
  }
  const ClockOffset clocks = estimate_clock_offset(master, slave);
  EXPECT_FALSE(clocks.one_rate);
  EXPECT_NEAR(clocks.offset_s, -0.1, 1e-9);  // the middle of the run
  EXPECT_NEAR(clocks.bound_s, 0.1, 1e-9);    // reaches just to both ends
}

TEST(Merge, HasNoBoundWithoutPacketsInBothDirections) {
  const ClockOffset clocks = estimate_clock_offset({{1, StationSample{}}}, {{1, StationSample{}}});
  EXPECT_EQ(clocks.offset_s, 0);
  EXPECT_TRUE(std::isinf(clocks.bound_s));
}

TEST(SessionFile, ComesBackAsItWas) {
  ScratchDirectory scratch;
  TwoHosts{}.record(scratch.path());
  {
    Recording netem(scratch / "netem.mcap", info_of("netem", kMasterStart));
    LinkSample sample;
    sample.lost = true;
    netem.write(kMasterStart + kSecond, sample);
    netem.finish({});
  }
  const Session before = merge_recordings(scratch.path());
  write_session_mcap(before, scratch / "session.mcap");
  const Session after = read_session_mcap(scratch / "session.mcap");
  EXPECT_EQ(after.scene_name, "wall");
  EXPECT_EQ(after.scene_text, before.scene_text);
  EXPECT_EQ(after.seed, 3u);
  EXPECT_EQ(after.clock_offset_s, before.clock_offset_s);
  EXPECT_EQ(after.clock_offset_bound_s, before.clock_offset_bound_s);
  EXPECT_EQ(after.master_counters.sent, 1u);
  EXPECT_EQ(after.slave_counters.sent, 2u);
  ASSERT_EQ(after.slave.size(), before.slave.size());
  for (std::size_t i = 0; i < after.slave.size(); ++i) {
    ASSERT_EQ(after.slave[i].t_s, before.slave[i].t_s);
    ASSERT_EQ(after.slave[i].x_rad, before.slave[i].x_rad);
    ASSERT_TRUE(std::isnan(after.slave[i].true_x_rad));
    ASSERT_EQ(after.slave[i].newest_peer_send_ns, before.slave[i].newest_peer_send_ns);
  }
  ASSERT_EQ(after.link.size(), 1u);
  EXPECT_TRUE(after.link[0].lost);
  EXPECT_EQ(after.link[0].t_s, 1.0);
  ASSERT_EQ(after.events.size(), before.events.size());
  EXPECT_EQ(after.events.back().text, before.events.back().text);
  EXPECT_THROW(read_session_mcap(scratch / "master.mcap"), std::runtime_error);
}

TEST(SessionDirectory, IsNeverUsedTwice) {
  ScratchDirectory scratch;
  const std::int64_t utc = 1'767'323'045 * kSecond;  // 2026-01-02 03:04:05
  const std::string root = scratch.path().string() + "/sessions";
  EXPECT_EQ(session_directory(root, utc, "wall", 7), root + "/20260102T030405Z-wall-7");
  EXPECT_EQ(session_directory(root, utc, "wall", 7), root + "/20260102T030405Z-wall-7-2");
  EXPECT_EQ(session_directory(root, utc, "/some/where/wall.txtpb", 7), root + "/20260102T030405Z-wall-7-3");
  EXPECT_TRUE(std::filesystem::is_directory(root + "/20260102T030405Z-wall-7-3"));
  EXPECT_THROW(session_directory("/proc/none", utc, "wall", 7), std::runtime_error);
}

}  // namespace
}  // namespace farhand
