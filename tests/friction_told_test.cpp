// Friction of the patient's device, as the box tells it and the therapist's station hands it to its law.
#include <gtest/gtest.h>

#include <cmath>

#include "common/station/station.hpp"

namespace farhand {
namespace {

// Follows nothing and remembers what it was told.
class Listener : public Law<1> {
 public:
  void start(const LawInputs<1>& /*in*/) noexcept override {}
  Wish<1> step(const LawInputs<1>& in) noexcept override {
    friction = in.peer_friction;
    known = in.peer_friction_known;
    return {};
  }
  double friction = -1.0;
  bool known = true;
};

using DirectStation = Station<DirectIo<1>>;

Packet<1> packet_of(Role role, const KnownFriction& friction) {
  StationParams params;
  params.role = role;
  params.friction = friction;
  Listener law;
  DirectStation station(params, law);
  return station.tick(kMillisecond, {}).packet;
}

TEST(FrictionTold, ABoxThatWasNeverSweptTellsTheCautiousValueAndALeaderNone) {
  const Packet<1> box = packet_of(Role::kFollower, {}), leader = packet_of(Role::kLeader, {});
  EXPECT_EQ(box.friction, 0.1);
  EXPECT_FALSE(box.friction_known);
  EXPECT_EQ(leader.friction, 0.0);
  EXPECT_FALSE(leader.friction_known);
  const Packet<1> swept = packet_of(Role::kFollower, {.threshold = 0.03, .known = true});
  EXPECT_EQ(swept.friction, 0.03);
  EXPECT_TRUE(swept.friction_known);
}

TEST(FrictionTold, TheLawHearsItInItsOwnSizeAndWithinItsOwnTorque) {
  Listener law;
  StationParams params;
  params.role = Role::kLeader;
  params.scale.force = 2.0;
  params.intake.torque = 3.0;
  DirectStation station(params, law);
  Nanoseconds now = kMillisecond;
  station.tick(now, {});
  EXPECT_TRUE(std::isnan(law.friction)) << "nothing was heard yet";
  EXPECT_FALSE(law.known);
  std::uint32_t seq = 0;
  const auto told = [&](double friction, bool known) {
    now += kMillisecond;
    Packet<1> packet;
    packet.session = 7;
    packet.seq = ++seq;
    packet.send_time_ns = now;
    packet.friction = friction;
    packet.friction_known = known;
    station.receive(packet, now);
    station.tick(now, {});
    EXPECT_EQ(law.known, known);
    return law.friction;
  };
  EXPECT_EQ(told(0.05, true), 0.1);
  EXPECT_EQ(told(0.0, true), 0.0);
  EXPECT_EQ(told(1e300, false), 3.0);
  EXPECT_TRUE(std::isnan(told(-1.0, false)));
}

}  // namespace
}  // namespace farhand
