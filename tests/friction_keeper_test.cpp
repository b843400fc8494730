// The results of sweeps as they come into the patient's file, in virtual time: the box is ticked by hand.
#include "common/runtime/friction_keeper.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/config/load.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

constexpr std::int64_t kStart = 1'796'117'400;  // 2026-12-01T09:30:00Z

std::string text_in(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class SweptBox {
 public:
  explicit SweptBox(FrictionKeeper& keeper) : keeper_(keeper) {
    for (int k = 0; k < 100; ++k) tick(OperatorAct::kNone);
  }
  StationState tick(OperatorAct act) {
    time_.now_ns = time_.deadline_ns = time_.elapsed_ns += kMillisecond;
    const double t_s = to_seconds(time_.elapsed_ns);
    side_->tick(time_.now_ns, t_s, act, 1);
    keeper_.ticked({time_, t_s, *side_, {.act = act}, totals_});
    return side_->trace().state;
  }
  // Until it is over.
  StationState sweep() {
    for (tick(OperatorAct::kSweep); side_->trace().state == StationState::kSweeping;) tick(OperatorAct::kNone);
    return side_->trace().state;
  }

 private:
  FrictionKeeper& keeper_;
  std::unique_ptr<Side> side_ = make_simulated_slave(
      load_scene("zero_delay", std::vector<std::string>{"slave.hand={from_s: 1e6}", "slave.motor.coulomb_nm=0.05"})
          .scene,
      1);
  TickTime time_;
  StationCounters totals_;
};

TEST(FrictionKeeper, ASweepIsInTheFileWhileTheSessionGoesOnAndARefusedOneLosesNothing) {
  ScratchDirectory scratch;
  const auto file = scratch / "friction";
  FrictionKeeper keeper(file, kStart);
  EXPECT_EQ(keeper.known().threshold, 0.1);
  EXPECT_EQ(keeper.in_force().threshold_nm, 0.1);
  EXPECT_FALSE(keeper.in_force().measured);
  SweptBox box(keeper);
  ASSERT_EQ(box.sweep(), StationState::kReady);
  for (int k = 0; k < 600 && !std::filesystem::exists(file); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const auto result = load_friction(file);
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->F_c, 0.05, 0.01);
  EXPECT_GT(result->utc_s, kStart + 20);
  EXPECT_LT(result->utc_s, kStart + 60);
  const std::string text = text_in(file);
  box.tick(OperatorAct::kSweep);
  ASSERT_EQ(box.tick(OperatorAct::kHold), StationState::kFault);
  EXPECT_TRUE(keeper.finish());
  EXPECT_TRUE(keeper.in_force().measured);
  EXPECT_NEAR(keeper.in_force().F_c_nm, result->F_c, 1e-4);
  EXPECT_EQ(keeper.in_force().threshold_nm, keeper.in_force().F_c_nm);
  EXPECT_EQ(keeper.in_force().swept_utc_s, result->utc_s);
  EXPECT_EQ(text_in(file), text);
}

TEST(FrictionKeeper, AResultThatCannotBeWrittenIsSaid) {
  ScratchDirectory scratch;
  const auto file = scratch / "friction";
  FrictionKeeper keeper(file, kStart);
  std::ofstream(file) << "of another program\n";
  SweptBox box(keeper);
  ASSERT_EQ(box.sweep(), StationState::kReady);
  testing::internal::CaptureStderr();
  EXPECT_FALSE(keeper.finish());
  EXPECT_EQ(text_in(file), "of another program\n");
  testing::internal::GetCapturedStderr();
}

}  // namespace
}  // namespace farhand
