// The architectures: that each has its row and a name in scenes, and holds its blocks and nothing else.
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

#include "common/law/architectures.hpp"
#include "common/law/automatic.hpp"
#include "common/law/four_channel_cdob.hpp"
#include "common/law/four_channel_cdob_sdcv.hpp"
#include "common/law/four_channel_tank.hpp"
#include "common/law/two_channel.hpp"
#include "common/law/two_channel_po_pc.hpp"
#include "common/law/wave.hpp"
#include "proto/scene.pb.h"

namespace farhand {
namespace {

TEST(Architectures, AreTheOnesThatASceneMayName) {
  std::set<std::string> rows, named;
  for (const Architecture& row : architectures()) {
    EXPECT_TRUE(rows.insert(std::string(row.name)).second) << row.name;
    EXPECT_FALSE(row.source.empty()) << row.name;
  }
  const auto* values = scene::Architecture_descriptor();
  for (int k = 0; k < values->value_count(); ++k) {
    if (values->value(k)->number() != 0) named.insert(std::string(values->value(k)->name()));
  }
  EXPECT_EQ(rows, named);
  EXPECT_THROW(architecture("FIVE_CHANNEL"), std::invalid_argument);
}

TEST(Architectures, NeedTheSameOfBothSidesAndSayHowLargeTheyAre) {
  const LawParams p;
  const FourChannelGains K{.K_p = 400, .K_d = 40, .K_f = 250};
  for (const Architecture& row : architectures()) {
    const auto master = row.master.make(p, K, 1e-3), slave = row.slave.make(p, K, 1e-3);
    EXPECT_EQ(master->needs().account, slave->needs().account) << row.name;  // packets of one layout
    EXPECT_GE(row.master.bytes, sizeof(Law<1>)) << row.name;
    EXPECT_GE(row.slave.bytes, sizeof(Law<1>)) << row.name;
  }
}

// Not engaged, a law tells of its axis and remembers nothing of the peer: engaged later, it wishes the same.
TEST(Architectures, NotEngagedTheyTellAndForgetThePeer) {
  const LawParams p;
  const FourChannelGains K{.K_p = 400, .K_d = 40, .K_f = 250};
  for (const Architecture& row : architectures()) {
    for (const LawMaker& maker : {row.master, row.slave}) {
      const auto fresh = maker.make(p, K, 1e-3), used = maker.make(p, K, 1e-3);
      LawInputs<1> in;
      in.local = {Joints<1>(0.1), Joints<1>(0.2), Joints<1>(0.3)};
      for (int k = 0; k < 500; ++k) {
        in.received = {Joints<1>(0.01 * k), Joints<1>(-1.0), Joints<1>(2.0)};
        const Wish<1> wish = used->step(in);
        EXPECT_EQ(wish.tell.x[0], 0.1) << row.name;
        EXPECT_EQ(wish.tell.v[0], 0.2) << row.name;
      }
      in.received = {Joints<1>(0.11), Joints<1>(0.1), Joints<1>(-0.2)};
      in.engaged = true;
      LawInputs<1> idle = in;
      idle.engaged = false;
      fresh->step(idle);  // its first, as the other has had
      fresh->start(in);
      used->start(in);
      const Wish<1> a = fresh->step(in), b = used->step(in);
      EXPECT_EQ(a.follow.x[0], b.follow.x[0]) << row.name;
      EXPECT_EQ(a.follow.v[0], b.follow.v[0]) << row.name;
      EXPECT_NEAR(a.follow.f[0], b.follow.f[0], 1e-12) << row.name;
      EXPECT_EQ(a.as_torque, b.as_torque) << row.name;
    }
  }
}

// What an architecture does not need is not in its object: its blocks, the face, and a few numbers of its own.
TEST(Architectures, HoldTheirBlocksAndNothingElse) {
  constexpr std::size_t kOwn = 64;
  const auto expect = [](std::size_t law, std::size_t blocks, const char* name) {
    EXPECT_GE(law, blocks) << name;
    EXPECT_LE(law, blocks + kOwn) << name;
  };
  using PatientsOnes = std::optional<PatientsThresholds<1>>;
  expect(sizeof(FourChannel<1>), 0, "FOUR_CHANNEL");
  expect(sizeof(FourChannelCdob<1>), sizeof(Cdob<1>), "FOUR_CHANNEL_CDOB");
  expect(sizeof(FourChannelCdobSdcv<1>), sizeof(Cdob<1>) + sizeof(Sdcv<1>) + sizeof(PatientsOnes), "with SDCV");
  expect(sizeof(ModelMediated<1>), sizeof(Mediator<1>), "MODEL_MEDIATED");
  expect(sizeof(Automatic<1>), sizeof(ModelMediated<1>) + sizeof(FourChannel<1>) + sizeof(Chooser), "AUTOMATIC");
  expect(sizeof(FourChannelTank<1>), sizeof(EnergyTank) + sizeof(LowPass<1>), "FOUR_CHANNEL_TANK");
  expect(sizeof(TwoChannelMaster<1>), sizeof(TwoChannelParams) + sizeof(HeldTo<1>), "TWO_CHANNEL, master");
  expect(sizeof(TwoChannelSlave<1>), sizeof(TwoChannelParams), "TWO_CHANNEL, slave");
  expect(sizeof(PassiveMaster<1>), sizeof(TwoChannelParams) + sizeof(AccountedPort<1>) + sizeof(HeldTo<1>), "PO/PC");
  expect(sizeof(WaveMaster<1>), sizeof(MasterWave<1>) + sizeof(ReceivedWave<1>), "WAVE, master");
  expect(sizeof(WaveSlave<1>), sizeof(SlaveWave<1>) + sizeof(ReceivedWave<1>), "WAVE, slave");
}

}  // namespace
}  // namespace farhand
