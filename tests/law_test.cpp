// The architectures: that each has its row and a name in scenes, and holds its blocks and nothing else.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/law/architectures.hpp"
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
    EXPECT_EQ(master->needs().previous, slave->needs().previous) << row.name;
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

// What an architecture does not need is not in its object: its blocks, as its row has them, and a few numbers beside.
TEST(Architectures, HoldTheirBlocksAndNothingElse) {
  constexpr std::size_t kOwn = 64;
  for (const Architecture& row : architectures()) {
    for (const LawMaker& law : {row.master, row.slave}) {
      std::size_t blocks = 0;
      for (const LawBlock& block : law.blocks) blocks += block.bytes;
      EXPECT_GE(law.bytes, blocks) << row.name;
      EXPECT_LE(law.bytes, blocks + kOwn) << row.name;
    }
  }
}

TEST(Architectures, SayOfEachBlockWhyItIsThereAndWhatItCosts) {
  const LawParams p;
  const FourChannelGains K{.K_p = 400, .K_d = 40, .K_f = 250};
  std::vector<LawInputs<1>> seen(1000);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    seen[k].local = {Joints<1>(0.1 * t), Joints<1>(0.1), Joints<1>(0.2 * t)};
    seen[k].received = {Joints<1>(0.09 * t), Joints<1>(0.1), Joints<1>(-0.1 * t)};
  }
  for (const Architecture& row : architectures()) {
    for (const LawMaker& law : {row.master, row.slave}) {
      std::set<std::string_view> names;
      for (const LawBlock& block : law.blocks) {
        EXPECT_TRUE(names.insert(block.name).second) << row.name << ' ' << block.name;
        EXPECT_FALSE(block.why.empty()) << block.name;
        EXPECT_FALSE(block.without.empty()) << block.name;
        EXPECT_GT(block.bytes, 0u) << block.name;
        EXPECT_EQ(block.idle == Idle::kNever, block.instead.empty()) << block.name;
        if (!block.instead.empty()) {
          EXPECT_NE(find_architecture(block.instead), nullptr) << block.name;
        }
        ASSERT_NE(block.run, nullptr) << block.name;
        EXPECT_TRUE(std::isfinite(block.run(p, K, 1e-3, seen))) << block.name;
        for (const std::string_view setting : block.settings) {
          if (setting.empty()) continue;
          ASSERT_TRUE(setting.starts_with("control.")) << setting;
          const std::string field(setting.substr(std::string_view("control.").size()));
          EXPECT_NE(scene::Control::descriptor()->FindFieldByName(field), nullptr) << setting;
        }
      }
    }
  }
}

}  // namespace
}  // namespace farhand
