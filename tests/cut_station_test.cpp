// The station that the benchmark of what is left out compares with does the same.
#include "tests/bench/cut_station.hpp"

#include <gtest/gtest.h>

#include "common/config/station_params.hpp"
#include "common/runtime/owned_station.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/station_inputs.hpp"

namespace farhand {
namespace {

TEST(CutStation, GivesTheSameTorquesAndPackets) {
  const LoadedScene loaded = load_scene("zero_delay", std::vector<std::string>{"windows={}", "duration_s=14"});
  const Session session = simulate(loaded);
  const std::vector<Arrival> arrivals = arrivals_of(session, true);
  const StationParams params = master_station_params(loaded.scene, kMasterSession);
  OwnedStation<DirectIo<1>> whole(params);
  cut::Station cut(cut::params_of(params));
  int engaged = 0;
  auto next = arrivals.begin();
  for (const StationSample& row : session.master) {
    const Nanoseconds now = from_seconds(row.t_s);
    for (; next != arrivals.end() && next->at <= now; ++next) {
      whole.receive(next->packet, next->at);
      cut.receive(next->packet, next->at);
    }
    const OperatorAct act = row.t_s == 0.2 ? OperatorAct::kEngage : OperatorAct::kNone;
    const auto a = whole.tick(now, {Joints<1>(row.x_rad), true}, act);
    const auto b = cut.tick(now, Joints<1>(row.x_rad), true, act, 1);
    ASSERT_EQ(a.command.torque[0], b.torque[0]) << row.t_s;
    ASSERT_EQ(a.packet.motion.f[0], b.packet.motion.f[0]);
    ASSERT_EQ(a.packet.state, b.packet.state);
    ASSERT_EQ(a.packet.limits, b.packet.limits);
    engaged += b.packet.state == StationState::kEngaged;
  }
  EXPECT_GT(engaged, 10000);
}

}  // namespace
}  // namespace farhand
