// The bare loop against the real stations, and what the lab says about the error of its integrators.
#include <gtest/gtest.h>

#include <cmath>

#include "common/config/load.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "tests/lab/bare_loop.hpp"
#include "tests/lab/bare_world.hpp"
#include "tests/lab/precision.hpp"
#include "tests/lab/simulation.hpp"

namespace farhand {
namespace {

const std::vector<std::string> kIdealEncoders = {"master.motor.encoder_counts_per_rev=0",
                                                 "slave.motor.encoder_counts_per_rev=0"};

template <template <class> class Scene>
void expect_the_stations_motion(const char* name) {
  const LoadedScene loaded = load_scene(name, kIdealEncoders);
  const scene::Scene& s = loaded.scene;
  const Session session = simulate(loaded);
  using Master = DirectSide<BlockLaw<Scene>, Held, WorldSolver<MasterWorld>>;
  using Slave = DirectSide<BlockLaw<FourChannel>, Held, WorldSolver<DirectSlaveWorld>>;
  const auto ticks = [&s](double delay_s) { return static_cast<std::size_t>(std::lround(delay_s / s.tick_s())); };
  BareLoop<Master, Slave> loop(
      Master(master_station_params(s, 1).scene, {},
             WorldSolver<MasterWorld>(MasterWorld(master_world_params(s), world_numerics(s))), {}, 0),
      Slave(slave_station_params(s, 2).scene, {},
            WorldSolver<DirectSlaveWorld>(DirectSlaveWorld(direct_slave_world_params(s), world_numerics(s))), {}, 0),
      s.tick_s(),
      ticks(s.network().forward().delay_s()), ticks(s.network().backward().delay_s()), 0.0);
  double worst = 0, moved = 0;
  for (std::size_t k = 0; k < session.master.size(); ++k) {
    worst = std::max({worst, std::abs(loop.master().solver().state()[0] - session.master[k].true_x_rad),
                      std::abs(loop.slave().solver().state()[0] - session.slave[k].true_x_rad)});
    moved = std::max(moved, std::abs(session.slave[k].true_x_rad));
    loop.tick();
  }
  EXPECT_GT(moved, 0.05);
  EXPECT_LT(worst, 1e-12);
  std::printf("%s: largest difference of angle %.2g rad\n", name, worst);
}

// The shipped scenes rest until both sides are engaged, so that engagement leaves nothing but rounding behind; plain
// four channels carry that on for a while.
TEST(BareLoop, IsWhatTheStationsDoOnceEngaged) {
  expect_the_stations_motion<FourChannel>("four_channel");
  expect_the_stations_motion<FourChannel>("four_channel_wall");
  expect_the_stations_motion<FourChannel>("zero_delay");
  expect_the_stations_motion<FourChannelCdob>("four_channel_cdob");
  expect_the_stations_motion<FourChannelCdobSdcv>("four_channel_cdob_sdcv");
}

}  // namespace
}  // namespace farhand
