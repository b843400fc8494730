// Every scene against the same laws written by hand, and its promise to touch neither heap nor mutex.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/link/codec.hpp"
#include "common/record/recorder.hpp"
#include "common/record/sample.hpp"
#include "common/runtime/side.hpp"
#include "common/signal/delay_line.hpp"
#include "netem/lab/bare_law.hpp"
#include "netem/lab/emulated_slave.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

void expect_the_same_torque_and_limits(const char* architecture, std::uint64_t seed) {
  Dice dice(seed);
  Seen seen;
  double worst = 0;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    const ControlParams p = dice.settings();
    const auto scene = make_block_law(architecture, p), plain = make_plain_law<double>(architecture, p);
    bool fresh = true;
    for (int k = 0; k < kTicks; ++k) {
      double in[4];
      const bool poisoned = dice.next(in);
      const auto [x, x_r, v_r, f_r] = in;
      const Sent<double> received{x_r, v_r, f_r};
      if (fresh && !poisoned) {  // what is no number stays in filters until they are started anew
        scene->reset(x, received);
        plain->reset(x, received);
        fresh = false;
      }
      const Sent<double> local = scene->observe(x), as_expected = plain->observe(x);
      const double torque = scene->follow(received), expected = plain->follow(received);
      ASSERT_NEAR(torque, expected, 1e-12) << "episode " << episode << " tick " << k;
      ASSERT_EQ(scene->limits(), plain->limits()) << "episode " << episode << " tick " << k;
      worst = std::max(worst, std::abs(torque - expected));
      if (std::isfinite(as_expected.f)) {
        ASSERT_NEAR(local.v, as_expected.v, 1e-12);
        ASSERT_NEAR(local.f, as_expected.f, 1e-12);
      }
      if (poisoned) {
        ASSERT_TRUE(plain->limits() & kLimitNotFinite);
        fresh = true;
      }
      seen.add(plain->limits());
    }
  }
  for (const LimitBit bit : {kLimitTorque, kLimitRate, kLimitRange, kLimitNotFinite})
    EXPECT_GT(seen.of(bit), 100) << bit;
  std::printf("largest difference of torque %.2g N m\n", worst);
}

TEST(Scene, FourChannelIsTheHandWrittenStep) { expect_the_same_torque_and_limits("FOUR_CHANNEL", 1); }
TEST(Scene, CdobIsTheHandWrittenStep) { expect_the_same_torque_and_limits("FOUR_CHANNEL_CDOB", 2); }
TEST(Scene, CdobSdcvIsTheHandWrittenStep) { expect_the_same_torque_and_limits("FOUR_CHANNEL_CDOB_SDCV", 3); }

// Master and slave as in the lab, every packet through the codec and 50 ms of delay, every tick into a recorder.
class RealTime : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, RealTime,
                         testing::Values("four_channel", "four_channel_cdob", "four_channel_cdob_sdcv",
                                         "four_channel_mediated", "two_channel", "wave", "four_channel_tank",
                                         "auto_detour", "two_channel_po_pc", "sea_four_channel_cdob_sdcv",
                                         "sea_four_channel_mediated"),
                         [](const auto& scene) { return std::string(scene.param); });

TEST_P(RealTime, TouchesNeitherHeapNorMutexOver10000Ticks) {
  if (kCounterIsBlind) GTEST_SKIP() << "the sanitizer brings its own malloc and mutexes";
  std::vector<std::string> sets;
  if (GetParam() == std::string("sea_four_channel_cdob_sdcv")) sets.push_back("control.sdcv_from_patient=true");
  const LoadedScene loaded = load_scene(GetParam(), sets);
  const std::unique_ptr<Side> master = make_simulated_master(loaded.scene, 1);
  const std::unique_ptr<Side> slave = loaded.scene.slave().device() == scene::SERIES_ELASTIC
                                          ? make_emulated_slave(loaded.scene, 2)
                                          : make_simulated_slave(loaded.scene, 2);
  using Datagram = std::array<std::byte, PacketCodec<1>::kMostBytes>;
  PacketCodec<1> codec(master->packet_parts());
  DelayLine<Datagram, 64> forward(50), backward(50);
  ScratchDirectory scratch;
  record::RunInfo info;
  info.set_role("master");
  Recorder recorder(scratch / "master.mcap", info, 32'768);  // virtual time outruns its thread

  const auto pass = [&](DelayLine<Datagram, 64>& line, const Packet<1>& sent, Side& receiver, Nanoseconds now) {
    Datagram datagram;
    const std::span<const std::byte> bytes = codec.encode(sent);
    std::copy(bytes.begin(), bytes.end(), datagram.begin());
    Packet<1> packet;
    const Datagram came = line.step(datagram);
    if (codec.decode(std::span(came).first(bytes.size()), packet) == DecodeResult::kOk) receiver.receive(packet, now);
  };
  int engaged = 0;
  const auto tick = [&](int k) {
    const Nanoseconds now = k * kMillisecond;
    const double t_s = to_seconds(now);
    const Packet<1> from_master = master->tick(now, t_s, k == 300 ? OperatorAct::kEngage : OperatorAct::kNone, 1);
    const Packet<1> from_slave = slave->tick(now, t_s, OperatorAct::kNone, 1);
    pass(forward, from_master, *slave, now);
    pass(backward, from_slave, *master, now);
    recorder.push(now, sample_of(master->trace(), master->receiver(), master->truth(), t_s));
    recorder.push(now, sample_of(slave->trace(), slave->receiver(), slave->truth(), t_s));
    engaged += slave->trace().state == StationState::kEngaged;
  };
  tick(0);
  const TouchCounter counter;
  for (int k = 1; k <= 10'000; ++k) tick(k);
  const Touched in_the_loop = counter.since();
  EXPECT_EQ(in_the_loop, Touched{}) << in_the_loop.heap << " heap calls, " << in_the_loop.locks << " locks";
  EXPECT_GT(engaged, 8'000);
  EXPECT_EQ(recorder.finish({}).overflow, 0u);
}

// Or the counts above would prove nothing.
TEST(TouchCounter, SeesADeliberateTouch) {
  if (kCounterIsBlind) GTEST_SKIP() << "the sanitizer brings its own malloc and mutexes";
  const TouchCounter counter;
  void* volatile block = std::malloc(16);
  std::free(block);
  std::mutex mutex;
  { const std::lock_guard lock(mutex); }
  EXPECT_EQ(counter.since(), (Touched{.heap = 2, .locks = 1}));
}

}  // namespace
}  // namespace farhand
