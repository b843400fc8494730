// Every scene against the same laws written by hand, and its promise to touch neither heap nor mutex.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <mutex>
#include <random>

#include "common/config/load.hpp"
#include "common/link/codec.hpp"
#include "common/record/recorder.hpp"
#include "common/record/sample.hpp"
#include "common/runtime/side.hpp"
#include "common/scene/four_channel.hpp"
#include "common/signal/delay_line.hpp"
#include "tests/bench/plain_step.hpp"
#include "tests/lab/emulated_slave.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr int kEpisodes = 200, kTicks = 500;  // 100,000 ticks of each scene

// Settings, movements and mishaps for one scene, the same for every seed.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}

  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(random_() >> 11) * 0x1p-53); }
  bool once_in(std::uint64_t n) { return random_() % n == 0; }

  SceneParams settings() {
    SceneParams p;
    p.drive.model = {.J_n = uniform(1e-3, 6e-3),
                     .K_tn = 0.15,
                     .viscous = uniform(0, 0.01),
                     .coulomb = uniform(0, 0.05),
                     .gravity = uniform(0, 0.5),
                     .gravity_angle = uniform(-2, 2)};
    p.drive.K = {.K_p = uniform(50, 900), .K_d = uniform(5, 60), .K_f = uniform(50, 250)};
    p.drive.g_dis = p.drive.g_reac = Cutoff::rad_s(uniform(50, 1000));
    p.drive.g_v = Cutoff::rad_s(uniform(100, 1000));
    p.drive.gate = {.torque = uniform(0.3, 4),
                    .torque_rate = uniform(50, 4000),
                    .velocity = uniform(0.5, 5),
                    .range_min = uniform(-0.4, -0.2),
                    .range_max = uniform(0.2, 0.4)};
    p.drive.take_over_s = uniform(0.05, 0.5);
    p.g_net = Cutoff::rad_s(uniform(100, 2000));
    p.local_model = once_in(2) ? LocalModel::kWithForce : LocalModel::kThesis;
    p.sdcv = {.f_1 = uniform(0.05, 0.3), .f_2 = uniform(0.4, 1), .alpha_cutoff = Cutoff::rad_s(uniform(1, 50))};
    return p;
  }

  // Walks through the range and beyond it, as an encoder sees it, and now and then jumps.
  double walk(double& position, double& speed) {
    speed = 0.99 * speed + uniform(-0.05, 0.05);
    position += 1e-3 * speed;
    if (once_in(400)) position = uniform(-0.45, 0.45);
    const double count = 2 * std::numbers::pi / 20000;
    return std::round(position / count) * count;
  }

  double not_a_number() {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    return once_in(3) ? std::numeric_limits<double>::quiet_NaN() : (once_in(2) ? kInf : -kInf);
  }

  // x, x_r, v_r, f_r of the next tick. True if one of them is no number.
  bool next(double (&in)[4]) {
    in[0] = walk(x_, v_);
    in[1] = walk(x_r_, v_r_);
    in[2] = v_r_;
    f_r_ = 0.995 * f_r_ + uniform(-0.05, 0.05);
    in[3] = once_in(50) ? uniform(-40, 40) : f_r_;
    if (!once_in(200)) return false;
    in[random_() % 4] = not_a_number();
    return true;
  }

 private:
  std::mt19937_64 random_;
  double x_ = 0, v_ = 0, x_r_ = 0, v_r_ = 0, f_r_ = 0;
};

// How often each limit acted: a comparison that never saw one proves nothing about it.
class Seen {
 public:
  void add(std::uint32_t limits) {
    for (std::uint32_t bit = 1; bit <= kAllLimits; bit <<= 1) count_[bit] += (limits & bit) != 0;
  }
  int of(LimitBit bit) const { return count_.at(bit); }

 private:
  std::map<std::uint32_t, int> count_;
};

Motion<1> motion(double x, double v, double f) { return {J1(x), J1(v), J1(f)}; }

template <template <class> class Scene, PlainScene kPlain>
void expect_the_same_torque_and_limits(std::uint64_t seed) {
  Dice dice(seed);
  Seen seen;
  double worst = 0;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    const SceneParams p = dice.settings();
    Scene<DirectDrive<1>> scene(p);
    PlainStep<kPlain> plain(p);
    bool fresh = true;
    for (int k = 0; k < kTicks; ++k) {
      double in[4];
      const bool poisoned = dice.next(in);
      const auto [x, x_r, v_r, f_r] = in;
      const Motion<1> received = motion(x_r, v_r, f_r);
      if (fresh && !poisoned) {  // what is no number stays in filters until they are started anew
        scene.drive.reset({.x = J1(x)});
        scene.start(received);
        plain.reset(x);
        plain.start(x_r, v_r, f_r);
        fresh = false;
      }
      const Motion<1> local = scene.drive.observe({.x = J1(x)}, 1);
      const double torque = scene.drive.follow(local, scene.target(local, received), true, 1).torque[0];
      const double expected = plain.step(x, x_r, v_r, f_r);
      ASSERT_NEAR(torque, expected, 1e-12) << "episode " << episode << " tick " << k;
      ASSERT_EQ(scene.drive.active_limits(), plain.limits) << "episode " << episode << " tick " << k;
      worst = std::max(worst, std::abs(torque - expected));
      if (std::isfinite(plain.f)) {
        ASSERT_NEAR(local.v[0], plain.v, 1e-12);
        ASSERT_NEAR(local.f[0], plain.f, 1e-12);
      }
      if (poisoned) {
        ASSERT_TRUE(plain.limits & kLimitNotFinite);
        fresh = true;
      }
      seen.add(plain.limits);
    }
  }
  for (const LimitBit bit : {kLimitTorque, kLimitRate, kLimitRange, kLimitNotFinite})
    EXPECT_GT(seen.of(bit), 100) << bit;
  std::printf("largest difference of torque %.2g N m\n", worst);
}

TEST(Scene, FourChannelIsTheHandWrittenStep) {
  expect_the_same_torque_and_limits<FourChannel, PlainScene::kFourChannel>(1);
}
TEST(Scene, CdobIsTheHandWrittenStep) { expect_the_same_torque_and_limits<FourChannelCdob, PlainScene::kCdob>(2); }
TEST(Scene, CdobSdcvIsTheHandWrittenStep) {
  expect_the_same_torque_and_limits<FourChannelCdobSdcv, PlainScene::kCdobSdcv>(3);
}

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
    FourChannelCdobSdcv<DirectDrive<1>> first(p), second(p);
    Dice other(static_cast<std::uint64_t>(100 + episode));
    for (int k = 0; k < kTicks; ++k) {
      double a[4], b[4];
      if (dice.next(a) || other.next(b)) continue;
      const Motion<2> received{{a[1], b[1]}, {a[2], b[2]}, {a[3], b[3]}};
      const auto one = [&](auto& scene, const double(&in)[4]) {
        const Motion<1> local = scene.drive.observe({.x = J1(in[0])}, 1);
        return scene.drive.follow(local, scene.target(local, motion(in[1], in[2], in[3])), true, 1).torque[0];
      };
      const Motion<2> local = both.drive.observe({.x = {a[0], b[0]}}, 1);
      const Joints<2> torque = both.drive.follow(local, both.target(local, received), true, 1).torque;
      ASSERT_NEAR(torque[0], one(first, a), 1e-12);
      ASSERT_NEAR(torque[1], one(second, b), 1e-12);
    }
  }
}

// Master and slave as in the lab, every packet through the codec and 50 ms of delay, every tick into a recorder.
class RealTime : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, RealTime,
                         testing::Values("four_channel", "four_channel_cdob", "four_channel_cdob_sdcv",
                                         "sea_four_channel_cdob_sdcv"),
                         [](const auto& scene) { return std::string(scene.param); });

TEST_P(RealTime, TouchesNeitherHeapNorMutexOver10000Ticks) {
  if (kCounterIsBlind) GTEST_SKIP() << "the sanitizer brings its own malloc and mutexes";
  const LoadedScene loaded = load_scene(GetParam());
  const std::unique_ptr<Side> master = make_simulated_master(loaded.scene, 1);
  const std::unique_ptr<Side> slave = loaded.scene.slave().device() == scene::SERIES_ELASTIC
                                          ? make_emulated_slave(loaded.scene, 2)
                                          : make_simulated_slave(loaded.scene, 2);
  using Datagram = std::array<std::byte, PacketCodec<1>::kSize>;
  PacketCodec<1> codec;
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
    if (codec.decode(line.step(datagram), packet) == DecodeResult::kOk) receiver.receive(packet, now);
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
