// A session of the real, secured programs through a bad network, while a schedule drawn from a seed kills them, stops
// them, cuts what is between them and presses the patient's stop: what was recorded must be safe all the time, nothing
// that was flushed may be lost, and nothing may grow. Forty seconds and an hour, both at night.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "common/record/mcap_reader.hpp"
#include "common/station/states.hpp"
#include "netem/lab/unexplained_step.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

// Jitter of two thirds of the delay, one packet in twenty lost; bursts and outages come from stopping the network.
constexpr const char* kScene = R"(
architecture: FOUR_CHANNEL_CDOB_SDCV
duration_s: 100000
control { K_f_per_kgm2: 125 f_1_nm: 0.2 f_2_nm: 0.45 }
master { therapist { grip: FIRM intended { duration_s: 100000 sine_amplitude_rad: 0.3 sine_frequency_hz: 0.25 } } }
slave { device: SERIES_ELASTIC hand { stiffness_nm_per_rad: 5 } axis { torque_limit_nm: 3 } }
network {
  forward { delay_s: 0.06 jitter_s: 0.04 distribution: UNIFORM loss: 0.05 }
  backward { delay_s: 0.06 jitter_s: 0.04 distribution: UNIFORM loss: 0.05 }
}
runtime { priority: 20 }
)";
constexpr double kTorqueLimit = 3, kJump = 1e-3;
constexpr Nanoseconds kLetGo = 300 * kMillisecond;  // serial 50 ms, MCU 20 + 50 ms, and what a busy machine adds
constexpr double kResting = 0.3;                    // N m in the spring of an orthosis that has long let go
// What a program may allocate once it records. Buffers that grow with the fullest chunk and the longest handshake so
// far: a quarter of a second of samples (70 kB) in a string that doubles and once more as it is written, 0.3 MB; a
// handshake with a peer that came back, 0.25 MB; the rest is margin. And for ever: a recording remembers each chunk for
// its index by 104 bytes in a vector that doubles (three times that while it grows) and a node of 64, at most nine
// chunks a second (a wake of the recorder every 200 ms, a cut every 250 ms). One allocation of 32 bytes that each tick
// forgets is ten times that.
constexpr double kBuffersKb = 1024, kIndexKbPerS = 9 * (3 * 104 + 64) / 1024.0;

using Clock = std::chrono::steady_clock;

bool driven(int state) { return asks_of(static_cast<StationState>(state)) == Asks::kMotion; }
bool engaged(const StationSample& row) { return row.state == static_cast<int>(StationState::kEngaged); }

// What the recordings of a session say, as they come to their ends.
class Findings {
 public:
  void take(const Recorded& recorded) {
    station(recorded.master, largest_jump_[0]);
    station(recorded.slave, largest_jump_[1]);
    for (const auto& [t, row] : recorded.slave) slave_.push_back({t, driven(row.state)});
    for (const auto& [t, row] : recorded.master) last_engaged_[0] = engaged(row) ? t : last_engaged_[0];
    for (const auto& [t, row] : recorded.slave) {
      last_engaged_[1] = engaged(row) ? t : last_engaged_[1];
      slave_rows_ += 1;
      engaged_rows_ += engaged(row);
    }
    orthosis(recorded.mcu);
  }

  void expect_safe(Nanoseconds last_mishap) {
    // The orthosis tracks only while the station that it belongs to drives it. A station that says nothing was stopped.
    std::ranges::sort(slave_);
    std::size_t against = 0;
    for (const Nanoseconds t : tracking_) {
      const auto until = std::ranges::upper_bound(slave_, t, {}, &Tick::first);
      const auto from = std::ranges::lower_bound(slave_, t - kLetGo, {}, &Tick::first);
      const bool saying = until - from > 200;
      against += saying && std::none_of(from, until, [](const Tick& tick) { return tick.second; });
    }
    std::printf(
        "recorded %zu s of the patient's side, %.0f %% engaged; most torque %.3f N m, most speed %.2f rad/s, in the "
        "spring at rest %.3f N m; largest jump %.3f mrad (master), %.3f mrad (slave)\n",
        slave_rows_ / 1000, 100.0 * static_cast<double>(engaged_rows_) / static_cast<double>(slave_rows_ + 1), torque_,
        speed_, resting_, 1e3 * largest_jump_[0].rad, 1e3 * largest_jump_[1].rad);
    EXPECT_GT(slave_rows_, 1000u);
    EXPECT_LE(torque_, kTorqueLimit);
    EXPECT_LE(resting_, kResting);
    for (const Jump& jump : largest_jump_) EXPECT_LE(jump.rad, kJump) << jump.ticks;
    EXPECT_EQ(against, 0u) << "the orthosis tracked although its station did not drive it";
    for (const Nanoseconds last : last_engaged_) EXPECT_GT(last, last_mishap) << "never came back to work";
  }

 private:
  using Tick = std::pair<Nanoseconds, bool>;
  struct Jump {
    double rad = 0;
    std::string ticks;
  };
  static void station(const Recorded::Series<StationSample>& rows, Jump& largest) {
    for (std::size_t k = 2; k < rows.size(); ++k) {
      const StationSample &before = rows[k - 1].second, &now = rows[k].second;
      const bool changed = now.state != before.state || before.state != rows[k - 2].second.state;
      if (!driven(now.state) || (engaged(now) && !changed)) continue;
      const double jump =
          unexplained_step(now.target_x_rad - before.target_x_rad, to_seconds(rows[k].first - rows[k - 1].first),
                           {before.v_rad_s, now.v_rad_s, before.remote_v_rad_s, now.remote_v_rad_s});
      if (jump > largest.rad) largest = {jump, ticks_around(rows, k)};
    }
  }
  static std::string ticks_around(const Recorded::Series<StationSample>& rows, std::size_t k) {
    std::string out;
    for (std::size_t i = k < 4 ? 0 : k - 4; i < std::min(k + 3, rows.size()); ++i) {
      const StationSample& row = rows[i].second;
      char line[256];
      std::snprintf(line, sizeof line,
                    "\n%s %+.3f ms %-8s x %.5f v %.3f, remote x %.5f v %.3f, target x %.5f, play-out %.3f s, newest "
                    "%.1f ms old",
                    i == k ? "->" : "  ", 1e3 * to_seconds(rows[i].first - rows[k].first),
                    name_of(static_cast<StationState>(row.state)), row.x_rad, row.v_rad_s, row.remote_x_rad,
                    row.remote_v_rad_s, row.target_x_rad, row.playout_delay_s,
                    1e3 * to_seconds(rows[i].first - row.newest_peer_arrival_ns));
      out += line;
    }
    return out;
  }
  void orthosis(const Recorded::Series<McuSample>& rows) {
    constexpr int kTrack = 1, kTorque = 2;
    Nanoseconds let_go_since = rows.empty() ? 0 : rows.front().first, before = let_go_since, resumed = 0;
    for (const auto& [t, row] : rows) {
      if (t - before > 10 * kMillisecond) resumed = t;  // stopped as a whole, its watchdog included
      before = t;
      torque_ = std::max({torque_, std::abs(row.spring_torque_nm), std::abs(row.true_f_nm)});
      speed_ = std::max(speed_, std::abs(row.true_v_rad_s));
      if (row.state == kTrack || row.state == kTorque) {
        let_go_since = t;
        if (t / kMillisecond % 20 == 0 && t - resumed > kLetGo) tracking_.push_back(t);
      } else if (t - let_go_since > kLetGo) {
        resting_ = std::max(resting_, std::abs(row.spring_torque_nm));
      }
    }
  }

  std::vector<Tick> slave_;
  std::vector<Nanoseconds> tracking_;
  Jump largest_jump_[2];
  double torque_ = 0, speed_ = 0, resting_ = 0;
  Nanoseconds last_engaged_[2] = {};
  std::size_t slave_rows_ = 0, engaged_rows_ = 0;
};

// What the program itself filled. Pages of its file and libraries come in when they are first needed, such as 1.6 MB
// by the first handshake, and go as the kernel likes.
double own_kb(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  double kb = 0;
  while (status >> word && word != "RssAnon:") {
  }
  status >> kb;
  return kb;
}

class RoughSession : public testing::Test {
 protected:
  void begin(std::uint64_t seed) {
    dice_.seed(seed);
    write_bytes(scratch_ / "rough.txtpb", kScene);
    const std::string key = (scratch_ / "key").string();
    ChildProcess pair({path_of(Program::kSlave), "pair", "--key", key});
    pair.end_input();
    ASSERT_EQ(pair.wait(), 0) << pair.err();
    session_ = std::make_unique<SessionProcesses>(scratch_.path(),
                                                  SessionOptions{(scratch_ / "rough.txtpb").string(), {}, {}, {}, key});
    for (const Program program : kPrograms) note_start(program);
    ASSERT_TRUE(comes_to_work()) << "never came to work";
    wait(2);
  }

  // Every kind of mishap once before any comes again.
  void mishaps(double seconds, bool with_kills, double longest_pause) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    std::vector<int> deck;
    for (bool first = true; first || !deck.empty() || Clock::now() < end; first = false) {
      if (deck.empty()) {
        for (int card = with_kills ? 0 : 4; card < 11; ++card) deck.push_back(card);
        std::ranges::shuffle(deck, dice_);
      }
      mishap(deck.back());
      deck.pop_back();
      wait(uniform(0.5, longest_pause));
    }
    last_mishap_ = Clock::now().time_since_epoch().count();
    EXPECT_TRUE(comes_to_work()) << "never came back to work";
  }

  void expect_good_end() {
    for (const Program program : kPrograms) look_at_memory(program);
    const auto codes = session_->stop();
    for (const Program program : kPrograms) {
      EXPECT_EQ(codes[static_cast<std::size_t>(program)], 130) << role_of(program) << (*session_)[program].err();
      const Recorded recorded = session_->recorded(program);
      EXPECT_TRUE(recorded.problems.empty()) << recorded.problems[0];
      findings_.take(recorded);
    }
    std::printf("%d mishaps: %d killed, %d stopped, %d times the patient's stop, %d acts of the operator\n",
                killed_ + stopped_ + pressed_ + acts_, killed_, stopped_, pressed_, acts_);
    std::printf(
        "flushed before a kill %llu, recovered %llu; memory grew by at most %.0f kB in the life of a program (%s)\n",
        static_cast<unsigned long long>(flushed_), static_cast<unsigned long long>(recovered_), growth_kb_,
        role_of(grew_most_));
    EXPECT_LE(unexplained_kb_, 0);
    findings_.expect_safe(last_mishap_);
  }

 private:
  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(dice_() >> 11) * 0x1p-53); }
  static void sleep(double seconds) { usleep(static_cast<useconds_t>(1e6 * seconds)); }

  // The operators engage whenever that is possible, after a reset where somebody stopped.
  void engage() {
    for (const Program program : {Program::kMaster, Program::kSlave}) (*session_)[program].say("reset\n");
    session_->engage();
  }
  bool comes_to_work() {
    return comes_true([&] {
      wait(1.5);
      const Recorded master = session_->recorded(Program::kMaster), slave = session_->recorded(Program::kSlave);
      return HasFatalFailure() || (!master.master.empty() && engaged(master.master.back().second) &&
                                   !slave.slave.empty() && engaged(slave.slave.back().second));
    });
  }

  void wait(double seconds) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    while (Clock::now() < end) {
      for (const Program program : kPrograms) {
        ASSERT_TRUE((*session_)[program].running()) << role_of(program) << (*session_)[program].err();
      }
      engage();
      for (const Program program : kPrograms) look_at_memory(program);
      sleep(0.5);
    }
  }

  void mishap(int card) {
    if (card < 4) return kill_and_start(kPrograms[static_cast<std::size_t>(card)]);
    if (card < 8) return stop_and_go(kPrograms[static_cast<std::size_t>(card - 4)]);
    if (card == 8) {
      ++pressed_;
      (*session_)[Program::kMcu].send_signal(SIGUSR1);
      sleep(uniform(0.3, 1.5));
      (*session_)[Program::kMcu].send_signal(SIGUSR2);
      return;
    }
    ++acts_;
    (*session_)[Program::kMaster].say(card == 9 ? "hold\n" : "stop\n");
    sleep(uniform(0.2, 1));
  }

  void stop_and_go(Program program) {
    ++stopped_;
    constexpr double kLongest[] = {0.1, 0.8, 4};
    (*session_)[program].send_signal(SIGSTOP);
    sleep(uniform(0.2, 1) * kLongest[dice_() % 3]);
    (*session_)[program].send_signal(SIGCONT);
  }

  // What was flushed before is there afterwards, and what the recording holds is looked at here, so that an hour of
  // them need not be kept.
  void kill_and_start(Program program) {
    ++killed_;
    look_at_memory(program);
    const std::filesystem::path whole = session_->recording(program), part = whole.string() + ".part";
    const bool any = std::filesystem::exists(part);
    const std::uint64_t flushed = any ? read_mcap(part, [](const McapMessage&) {}).messages : 0;
    session_->kill(program);
    if (any) {
      const McapFindings found = recover_mcap(part, whole);
      EXPECT_GE(found.messages, flushed) << role_of(program);
      flushed_ += flushed;
      recovered_ += found.messages;
      const Recorded recorded = read_recording(whole);
      EXPECT_TRUE(recorded.problems.empty()) << recorded.problems[0];
      findings_.take(recorded);
      std::filesystem::remove(part);
      std::filesystem::remove(whole);
    }
    sleep(uniform(0, 1.5));
    session_->start(program);
    note_start(program);
  }

  struct Memory {
    Clock::time_point recording;  // since when
    double settled_kb = 0;        // 0: not yet
  };
  void note_start(Program program) { memory_[static_cast<std::size_t>(program)] = {}; }
  // A program that waits for its peer has no recorder yet, and the 3 MB of its ring are still to come. From ten seconds
  // of recording on it has filled what it will fill.
  void look_at_memory(Program program) {
    Memory& memory = memory_[static_cast<std::size_t>(program)];
    const auto now = Clock::now();
    if (memory.recording == Clock::time_point()) {
      if (std::filesystem::exists(session_->recording(program).string() + ".part")) memory.recording = now;
      return;
    }
    const double s = std::chrono::duration<double>(now - memory.recording).count() - 10;
    if (s < 0) return;
    const double now_kb = own_kb((*session_)[program].pid());
    if (memory.settled_kb == 0) memory.settled_kb = now_kb;
    const double growth_kb = now_kb - memory.settled_kb;
    unexplained_kb_ = std::max(unexplained_kb_, growth_kb - kBuffersKb - kIndexKbPerS * s);
    if (growth_kb <= growth_kb_) return;
    growth_kb_ = growth_kb;
    grew_most_ = program;
  }

  ScratchDirectory scratch_;
  std::unique_ptr<SessionProcesses> session_;
  std::mt19937_64 dice_;
  Findings findings_;
  std::array<Memory, 4> memory_;
  int killed_ = 0, stopped_ = 0, pressed_ = 0, acts_ = 0;
  std::uint64_t flushed_ = 0, recovered_ = 0;
  double growth_kb_ = 0, unexplained_kb_ = -kBuffersKb;
  Program grew_most_ = Program::kMcu;
  Nanoseconds last_mishap_ = 0;
};

using NightlyRoughSession = RoughSession;
TEST_F(NightlyRoughSession, EveryMishapOnceIsSurvivedSafely) {
  begin(1);
  if (HasFatalFailure()) return;
  mishaps(0, true, 1);
  expect_good_end();
}

// Together an hour. Without kills everybody lives through the whole half.
TEST_F(NightlyRoughSession, HalfAnHourOfKillsAndStallsIsSurvivedSafely) {
  begin(2);
  if (HasFatalFailure()) return;
  mishaps(1800, true, 8);
  expect_good_end();
}
TEST_F(NightlyRoughSession, HalfAnHourOfStallsIsSurvivedSafelyAndNothingGrows) {
  begin(3);
  if (HasFatalFailure()) return;
  mishaps(1800, false, 8);
  expect_good_end();
}

}  // namespace
}  // namespace farhand
