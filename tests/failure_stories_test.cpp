// What happens to a session when one of its programs is killed, or the network is gone for a while: who says what, who
// stays alive, what is left of the recordings, and how the operator gets back to work. All with the real programs.
//
// A busy machine may make a station hold without our doing; the stories then engage again, as an operator would.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/link/packet.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/station/states.hpp"
#include "netem/lab/unexplained_step.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

using Series = Recorded::Series<StationSample>;

// Slow motion all the time, so that whatever happens happens in mid-motion; the operator is the test. No jitter, so
// that nothing overtakes: then the newest packet is also the last that was heard, and its arrival is in the recording.
constexpr const char* kScene = R"(
architecture: FOUR_CHANNEL_CDOB_SDCV
duration_s: 300
control { K_f_per_kgm2: 125 f_1_nm: 0.1 f_2_nm: 0.2 }
master { therapist { grip: NORMAL intended { duration_s: 1000 sine_amplitude_rad: 0.12 sine_frequency_hz: 0.25 } } }
slave { device: SERIES_ELASTIC hand { stiffness_nm_per_rad: 1 } }
network {
  forward { delay_s: 0.03 distribution: CONSTANT loss: 0.01 }
  backward { delay_s: 0.03 distribution: CONSTANT loss: 0.01 }
}
runtime { priority: 20 }
)";

constexpr double kTracking = 0.015;  // rad; below it the patient's hand is where the therapist's was
constexpr double kJump = 1e-3;       // rad
constexpr Nanoseconds kSettled = kSecond / 2;
constexpr Nanoseconds kTimeout = 100 * kMillisecond;  // the scene's default

bool is(const StationSample& row, StationState state) { return row.state == static_cast<int>(state); }
bool driven(const StationSample& row) { return asks_of(static_cast<StationState>(row.state)) == Asks::kMotion; }

// When the operator's last act was answered: the last tick at which the leader began to align. 0: never.
Nanoseconds last_engaging(const Series& master) {
  Nanoseconds at = 0;
  for (std::size_t k = 1; k < master.size(); ++k) {
    if (is(master[k].second, StationState::kAligning) && !is(master[k - 1].second, StationState::kAligning))
      at = master[k].first;
  }
  return at;
}

// From when on, after `from`, the slave was engaged and within kTracking of the master as played out, for kSettled and
// up to the end of the recording. 0: not yet.
Nanoseconds tracking_since(const Series& slave, Nanoseconds from) {
  Nanoseconds since = 0;
  for (const auto& [t, row] : slave) {
    const bool tracks =
        t > from && is(row, StationState::kEngaged) && std::abs(row.x_rad - row.remote_x_rad) < kTracking;
    if (!tracks) since = 0;
    if (tracks && since == 0) since = t;
  }
  return since > 0 && slave.back().first - since >= kSettled ? since : 0;
}

// The largest jump of the angle that the law follows where a jump would come from us: at each change of state and the
// tick after it, and all the time while aligning and holding. While engaged the target is the other hand, gaps of the
// network included.
double largest_jump(const Series& rows) {
  double largest = 0;
  for (std::size_t k = 2; k < rows.size(); ++k) {
    const StationSample &before = rows[k - 1].second, &now = rows[k].second;
    const bool changed = now.state != before.state || before.state != rows[k - 2].second.state;
    if (!driven(now) || (is(now, StationState::kEngaged) && !changed)) continue;
    largest = std::max(
        largest, unexplained_step(now.target_x_rad - before.target_x_rad, to_seconds(rows[k].first - rows[k - 1].first),
                                  {before.v_rad_s, now.v_rad_s, before.remote_v_rad_s, now.remote_v_rad_s}));
  }
  return largest;
}

// Engaged on a peer that had been silent for longer than the time-out: never, however the machine stalled. The
// recording holds when the newest packet came; an older one that was held up may have been heard up to half a time-out
// after it. (To the tick: reaction_test.cpp.)
bool engaged_on_silence(const Series& rows, Nanoseconds timeout) {
  return std::any_of(rows.begin(), rows.end(), [&](const auto& timed) {
    return is(timed.second, StationState::kEngaged) &&
           timed.first - timed.second.newest_peer_arrival_ns > 3 * timeout / 2;
  });
}

Nanoseconds longest_silence(const Series& rows) {
  Nanoseconds longest = 0;
  for (const auto& [t, row] : rows) {
    if (row.newest_peer_arrival_ns > 0) longest = std::max(longest, t - row.newest_peer_arrival_ns);
  }
  return longest;
}

bool says(const Recorded& recorded, const std::string& text) {
  return std::any_of(recorded.events.begin(), recorded.events.end(),
                     [&](const record::Event& event) { return event.text() == text; });
}

class Story : public testing::Test {
 protected:
  Story() { write_bytes(scratch_ / "story.txtpb", kScene); }

  void begin(const std::vector<std::string>& sets = {}) {
    session_ = std::make_unique<SessionProcesses>(scratch_.path(),
                                                  SessionOptions{(scratch_ / "story.txtpb").string(), sets, {}, {}});
    ASSERT_TRUE(works()) << "never came to work" << what_it_said();
  }

  // The operator engages until the patient's hand follows.
  bool works() {
    return comes_true([&] {
      const Recorded master = session_->recorded(Program::kMaster), slave = session_->recorded(Program::kSlave);
      if (master.master.empty() || slave.slave.empty()) return false;
      const StationSample& row = master.master.back().second;
      if (is(row, StationState::kReady) || is(row, StationState::kHolding)) {
        session_->engage();
        return false;
      }
      const Nanoseconds engaging = last_engaging(master.master);
      const Nanoseconds since = tracking_since(slave.slave, engaging);
      if (engaging == 0 || since == 0 || !is(row, StationState::kEngaged)) return false;
      took_s_ = to_seconds(since - engaging);
      return true;
    });
  }

  // What each program has recorded as events and said on its error stream.
  std::string what_it_said() {
    std::string out;
    for (const Program program : kPrograms) {
      const Recorded recorded = session_->recorded(program);
      out += std::string("\n") + role_of(program) + ((*session_)[program].running() ? ", running" : ", ended");
      for (const record::Event& event : recorded.events) {
        out += "\n  " + std::to_string(to_seconds(event.t_ns())) + " s " + event.text();
      }
      for (const Series* rows : {&recorded.master, &recorded.slave}) {
        if (rows->empty()) continue;
        const auto& [t, row] = rows->back();
        out += "\n  " + std::to_string(to_seconds(t)) +
               " s, last tick: " + name_of(static_cast<StationState>(row.state)) + ", x " + std::to_string(row.x_rad) +
               " rad, remote x " + std::to_string(row.remote_x_rad) + " rad; ticks: " + std::to_string(rows->size());
      }
      out += "\n" + (*session_)[program].err();
    }
    return out;
  }

  bool comes_to_say(Program program, const std::string& text) {
    return comes_true([&] { return says(session_->recorded(program), text); });
  }

  void expect_alive_but(Program dead) {
    for (const Program program : kPrograms) {
      if (program == dead) continue;
      EXPECT_TRUE((*session_)[program].running()) << role_of(program) << (*session_)[program].err();
    }
  }

  // Kills it, and nothing is lost of what it had flushed.
  void kill(Program program) {
    const std::filesystem::path part = session_->recording(program).string() + ".part";
    const bool recorded = std::filesystem::exists(part);
    const std::uint64_t flushed = recorded ? read_mcap(part, [](const McapMessage&) {}).messages : 0;
    session_->kill(program);
    if (!recorded) return;
    const std::filesystem::path mended = session_->recording(program).string() + ".mended";
    const McapFindings found = recover_mcap(part, mended);
    EXPECT_GE(found.messages, flushed) << role_of(program);
    EXPECT_GT(flushed, 0u);
    const McapFindings whole = read_mcap(mended, [](const McapMessage&) {});
    EXPECT_TRUE(whole.complete);
    EXPECT_EQ(whole.messages, found.messages);
  }

  void expect_back_at_work() {
    ASSERT_TRUE(works()) << "did not come back to work" << what_it_said();
    EXPECT_LE(took_s_, 3.0);
  }

  // Everybody ends as on a signal, with complete recordings in which nothing jumped.
  void expect_good_end() {
    const auto codes = session_->stop();
    for (const Program program : kPrograms) {
      EXPECT_EQ(codes[static_cast<std::size_t>(program)], 130) << role_of(program) << (*session_)[program].err();
    }
    const Recorded master = session_->recorded(Program::kMaster), slave = session_->recorded(Program::kSlave);
    for (const Recorded* recorded : {&master, &slave}) EXPECT_TRUE(recorded->problems.empty()) << recorded->problems[0];
    const double jump_m = largest_jump(master.master), jump_s = largest_jump(slave.slave);
    std::printf("back at work %.2f s after the act; largest jump %.3f mrad (master), %.3f mrad (slave)\n", took_s_,
                1e3 * jump_m, 1e3 * jump_s);
    EXPECT_LE(jump_m, kJump);
    EXPECT_LE(jump_s, kJump);
    EXPECT_FALSE(engaged_on_silence(master.master, kTimeout));
    EXPECT_FALSE(engaged_on_silence(slave.slave, kTimeout));
  }

  ScratchDirectory scratch_;
  std::unique_ptr<SessionProcesses> session_;
  double took_s_ = 0;
};

// Everything is lost for a while, from when both are at work: another link takes the place of the one that carried.
class Outage : public Story {
 protected:
  void lose_everything_for(int seconds) {
    begin();
    if (HasFatalFailure()) return;
    session_->kill(Program::kNetem);
    session_->start(Program::kNetem, {"network.forward.loss=1", "network.backward.loss=1"});
    EXPECT_TRUE(comes_to_say(Program::kMaster, "holding: peer silent"));
    EXPECT_TRUE(comes_to_say(Program::kSlave, "holding: peer silent"));
    EXPECT_TRUE(comes_true([&] {
      return longest_silence(session_->recorded(Program::kMaster).master) > seconds * kSecond &&
             longest_silence(session_->recorded(Program::kSlave).slave) > seconds * kSecond;
    }));
    for (const Program program : kPrograms) EXPECT_TRUE((*session_)[program].running()) << role_of(program);
    EXPECT_GT(session_->recorded(Program::kNetem).link.size(), 100u);  // they went on speaking
    session_->kill(Program::kNetem);
    session_->start(Program::kNetem);
    expect_back_at_work();
    expect_good_end();
  }
};

using Stories = Story;
using NightlyStories = Outage;
using StoriesOfTheNetwork = Outage;

TEST_F(StoriesOfTheNetwork, EverythingIsLostForFourSeconds) { lose_everything_for(4); }

TEST_F(NightlyStories, EverythingIsLostForTenSeconds) { lose_everything_for(10); }

TEST_F(Stories, MasterKilledThePatientIsHeldUntilItIsBack) {
  begin();
  if (HasFatalFailure()) return;
  kill(Program::kMaster);
  EXPECT_TRUE(comes_to_say(Program::kSlave, "holding: peer silent"));
  expect_alive_but(Program::kMaster);
  session_->start(Program::kMaster);
  expect_back_at_work();
  expect_good_end();
}

TEST_F(Stories, SlaveKilledTheMcuLetsGoAndTheTherapistIsHeld) {
  begin();
  if (HasFatalFailure()) return;
  kill(Program::kSlave);
  EXPECT_TRUE(comes_to_say(Program::kMaster, "holding: peer silent"));
  EXPECT_TRUE(comes_true([&] {
    const Recorded mcu = session_->recorded(Program::kMcu);
    return !mcu.mcu.empty() && mcu.mcu.back().second.state == 0;  // SAFE, by its own watchdog
  }));
  expect_alive_but(Program::kSlave);
  session_->start(Program::kSlave);
  expect_back_at_work();
  expect_good_end();
}

TEST_F(Stories, NetemKilledBothSidesHold) {
  begin();
  if (HasFatalFailure()) return;
  kill(Program::kNetem);
  EXPECT_TRUE(comes_to_say(Program::kSlave, "holding: peer silent"));
  EXPECT_TRUE(comes_to_say(Program::kMaster, "holding: peer silent"));
  expect_alive_but(Program::kNetem);
  session_->start(Program::kNetem);
  expect_back_at_work();
  expect_good_end();
}

TEST_F(Stories, McuKilledTheSlaveLetsGoAndTheMasterHolds) {
  begin();
  if (HasFatalFailure()) return;
  kill(Program::kMcu);
  EXPECT_TRUE(comes_to_say(Program::kSlave, "off: device lost"));
  EXPECT_TRUE(comes_to_say(Program::kMaster, "holding: peer let go"));
  expect_alive_but(Program::kMcu);
  session_->start(Program::kMcu);
  expect_back_at_work();
  expect_good_end();
}

TEST_F(Stories, WithoutItsDeviceAtTheEndTheSlaveSaysSoAndFails) {
  begin();
  if (HasFatalFailure()) return;
  session_->kill(Program::kMcu);
  EXPECT_TRUE(comes_to_say(Program::kSlave, "off: device lost"));
  ChildProcess& slave = (*session_)[Program::kSlave];
  slave.send_signal(SIGTERM);
  EXPECT_EQ(slave.wait(), 1);
  EXPECT_NE(slave.err().find("the device is lost"), std::string::npos) << slave.err();
  EXPECT_TRUE(session_->recorded(Program::kSlave).problems.empty());
}

}  // namespace
}  // namespace farhand
