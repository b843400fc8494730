// A real box whose program is stopped 8 ms in every 60: its therapist feels no more than without, and its report says
// first that the PC missed its ticks.
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "common/judge/metrics.hpp"
#include "common/record/merge.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"
#include "tests/support/stalled_session.hpp"

namespace farhand {
namespace {

// Stops the program again and again until it is told to cease. How exactly is up to the machine.
class Stops {
 public:
  explicit Stops(const ChildProcess& program)
      : thread_([this, &program] {
          std::this_thread::sleep_for(std::chrono::milliseconds(2500));
          while (!over_) {
            program.send_signal(SIGSTOP);
            std::this_thread::sleep_for(std::chrono::milliseconds(8));
            program.send_signal(SIGCONT);
            std::this_thread::sleep_for(std::chrono::milliseconds(52));
          }
        }) {}
  ~Stops() {
    over_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> over_{false};
  std::thread thread_;
};

// A machine that stands still for longer than the network's timer makes another session of it: that is run again.
TEST(StalledProcesses, ABoxThatIsStoppedEightMillisecondsInSixtyPressesNobodyAndItsReportSaysSoFirst) {
  const StallCell cell{"FOUR_CHANNEL_CDOB", false, 4096, "", "slave", 8, false, 60};
  LoadedScene scene = cell.load(false);
  const double usual_nm = persons_of(scene).therapist_nm;
  scene.scene.set_duration_s(8);
  for (int attempt = 1;; ++attempt) {
    ScratchDirectory scratch;
    write_bytes(scratch / "stalled.txtpb", complete_text(scene.scene));
    {
      SessionProcesses session(scratch.path(), {(scratch / "stalled.txtpb").string(), {}, {}, {}});
      {
        Stops stops(session[Program::kSlave]);
        EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
      }
      EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
      session.stop();
    }
    const Session session = merge_recordings(scratch.path());
    const Metrics metrics = compute_metrics(session, scene.scene);
    double most_nm = 0, reach_rad = 0;
    const bool held = metrics.number("held_s") > 0;
    for (const StationSample& row : session.master) {
      if (row.t_s < 2) continue;
      most_nm = std::max(most_nm, std::abs(row.true_f_nm));
    }
    for (const StationSample& row : session.slave) reach_rad = std::max(reach_rad, std::abs(row.true_x_rad));
    for (const StationCounters* side : {&session.master_counters, &session.slave_counters}) {
      std::printf("%llu ticks, %llu missed; ", static_cast<unsigned long long>(side->ticks),
                  static_cast<unsigned long long>(side->missed_ticks));
    }
    std::printf("missed %.1f %%, %.3f N m at the therapist (usual %.3f), reach %.3f rad%s\n",
                100 * metrics.number("missed_ticks"), most_nm, usual_nm, reach_rad, held ? ", held" : "");
    if (held && attempt < 4) continue;
    EXPECT_FALSE(held) << "in four attempts";
    EXPECT_LE(most_nm, usual_nm + 0.1);
    EXPECT_GT(metrics.number("missed_ticks"), 0.01);
    ASSERT_FALSE(metrics.list("reasons").empty());
    EXPECT_EQ(metrics.list("reasons").front().rfind("The PC of the ", 0), 0u) << metrics.list("reasons").front();
    return;
  }
}

}  // namespace
}  // namespace farhand
