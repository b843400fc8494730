// After a short gap of the network both sides go on by themselves: when they do, and everything after which they do
// not.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/station_pair.hpp"

namespace farhand {
namespace {

template <class Io>
struct Resuming : PairOn<Io> {
  explicit Resuming(Nanoseconds of_master = kSecond / 2, Nanoseconds of_slave = kSecond / 2) {
    const auto allow = [](auto& side, Nanoseconds longest) {
      side.own.engagement.longest_gap = side.own.receive.brief = longest;
      side.station.reset(new OwnedStation<Io>(side.own));
    };
    allow(this->master, of_master);
    allow(this->slave, of_slave);
    this->master.axis.rest[0] = this->slave.axis.rest[0] = 0.05;
  }
  void lose(bool from_master, bool from_slave, int ms) {
    this->forward = !from_master;
    this->backward = !from_slave;
    run(ms);
    this->forward = this->backward = true;
  }
  bool engaged() const { return this->master.state() == S::kEngaged && this->slave.state() == S::kEngaged; }
  // Counts every time that the patient's hand is taken.
  void run(int ms) {
    for (int k = 0; k < ms; ++k) {
      const S before = this->slave.state();
      this->tick();
      if (this->slave.state() == S::kEngaged && before != S::kEngaged) taken.push_back(this->now);
      resumed += this->slave.state() != before && this->slave.trace().reason == Reason::kResumed ? 1 : 0;
    }
  }
  std::size_t most_in_a_minute() const {
    std::size_t most = 0;
    for (std::size_t k = 0, from = 0; k < taken.size(); ++k) {
      while (taken[k] - taken[from] > 60 * kSecond) ++from;
      most = std::max(most, k - from + 1);
    }
    return most;
  }
  std::vector<Nanoseconds> taken;
  int resumed = 0;
};

template <class Io>
class Resumes : public testing::Test {};
using Devices = testing::Types<DirectIo<1>, ReferenceIo<1>>;
TYPED_TEST_SUITE(Resumes, Devices);

TYPED_TEST(Resumes, AfterAGapInEitherDirectionOrBoth) {
  for (const Nanoseconds delay : {kMillisecond, 30 * kMillisecond, 100 * kMillisecond}) {
    for (const int gap_ms : {120, 250, 480}) {
      for (const auto& [forward, backward] : {std::pair{true, true}, {true, false}, {false, true}}) {
        Resuming<TypeParam> pair;
        pair.delay = delay;
        pair.engage();
        pair.lose(forward, backward, gap_ms);
        pair.run(500);
        EXPECT_TRUE(pair.engaged()) << delay << ' ' << gap_ms << ' ' << forward << backward << ' '
                                    << name_of(pair.master.state()) << ' ' << name_of(pair.master.trace().reason) << ' '
                                    << name_of(pair.slave.state()) << ' ' << name_of(pair.slave.trace().reason);
        EXPECT_EQ(pair.resumed, 1);
        EXPECT_EQ(pair.master.trace().resumed, 1u);
        pair.run(3000);
        EXPECT_TRUE(pair.engaged()) << "it lasts";
        EXPECT_FALSE(pair.master.trace().resumes || pair.master.trace().waits || pair.slave.trace().waits);
      }
    }
  }
}

TYPED_TEST(Resumes, NotAfterALongerGapNorWhereEitherSideSaysNever) {
  const auto expect_held = [](Resuming<TypeParam>& pair, int gap_ms, bool forward, bool backward) {
    SCOPED_TRACE(testing::Message() << gap_ms << " ms " << forward << backward << ", "
                                    << pair.master.own.engagement.longest_gap / kMillisecond << " ms, "
                                    << pair.slave.own.engagement.longest_gap / kMillisecond << " ms");
    pair.engage();
    pair.lose(forward, backward, gap_ms);
    pair.run(5000);
    EXPECT_EQ(pair.resumed, 0);
    EXPECT_EQ(pair.master.state(), S::kHolding);
    EXPECT_EQ(pair.slave.state(), S::kHolding);
    pair.act = OperatorAct::kEngage;
    pair.run(3000);
    EXPECT_TRUE(pair.engaged()) << "by the operator's act";
  };
  for (const auto& [forward, backward] : {std::pair{true, true}, {true, false}, {false, true}}) {
    for (const int gap_ms : {520, 1000, 2000}) {
      Resuming<TypeParam> pair;
      expect_held(pair, gap_ms, forward, backward);
    }
    for (const auto& [master, slave] : {std::pair{0.0, 0.5}, {0.5, 0.0}, {0.0, 0.0}, {0.15, 0.5}, {0.5, 0.15}}) {
      Resuming<TypeParam> pair(from_seconds(master), from_seconds(slave));
      expect_held(pair, 250, forward, backward);
    }
  }
}

// What happens 20 ms before the gap, in the middle of it or 20 ms after it.
TYPED_TEST(Resumes, NotAfterAnythingElseThatHappenedMeanwhile) {
  using P = Resuming<TypeParam>;
  struct Mishap {
    const char* what;
    std::function<void(P&)> happens;
    bool idle_if_engaged = false;
  };
  const auto nan = [](auto& side) { side.fault.x[0] = kNan; };
  const std::vector<Mishap> mishaps{
      {"hold of the therapist", [](P& p) { p.act = OperatorAct::kHold; }},
      {"stop of the therapist", [](P& p) { p.act = OperatorAct::kStop; }},
      {"reset of the therapist", [](P& p) { p.act = OperatorAct::kReset; }, true},
      {"hold of the patient", [](P& p) { p.slave_act = OperatorAct::kHold; }},
      {"stop of the patient", [](P& p) { p.slave_act = OperatorAct::kStop; }},
      {"home at the patient", [](P& p) { p.slave_act = OperatorAct::kHome; }, true},
      {"fault of the therapist's device",
       [&](P& p) {
         nan(p.master);
         p.run(1);
         p.master.fault.x[0] = 0;
       }},
      {"fault of the patient's device",
       [&](P& p) {
         nan(p.slave);
         p.run(1);
         p.slave.fault.x[0] = 0;
       }},
      {"therapist's device lost",
       [](P& p) {
         p.master.connected = false;
         p.run(5);
         p.master.connected = true;
       }},
      {"patient's device lost",
       [](P& p) {
         p.slave.connected = false;
         p.run(5);
         p.slave.connected = true;
       }},
      {"restart of the therapist's program", [](P& p) { p.master.restart(77); }},
      {"restart of the patient's program", [](P& p) { p.slave.restart(78); }},
      {"the patient's hand moves by 6 degrees",
       [](P& p) {
         p.slave.axis.rest[0] += 0.6;
         p.run(60);
         p.slave.axis.rest[0] -= 0.6;
       },
       true},
  };
  for (const Mishap& mishap : mishaps) {
    for (const int when : {-20, 150, 270}) {
      P pair;
      pair.engage();
      const int resumed_before = pair.resumed;
      if (when < 0) mishap.happens(pair);
      pair.lose(true, true, 150);
      if (when == 150) mishap.happens(pair);
      pair.lose(true, true, 100);
      pair.run(20);
      if (when > 250) mishap.happens(pair);
      pair.run(4000);
      if (when < 0 && mishap.idle_if_engaged) continue;
      EXPECT_EQ(pair.resumed, resumed_before) << mishap.what << " at " << when;
      EXPECT_NE(pair.master.state(), S::kEngaged) << mishap.what << " at " << when;
      EXPECT_NE(pair.slave.state(), S::kEngaged) << mishap.what << " at " << when;
    }
  }
}

TYPED_TEST(Resumes, NotAfterAHostThatSlept) {
  for (const bool master : {true, false}) {
    Resuming<TypeParam> pair;
    pair.engage();
    auto& sleeper = master ? pair.master : pair.slave;
    auto& other = master ? pair.slave : pair.master;
    for (int k = 0; k < 250; ++k) {  // the one sleeps, the other goes on and is heard later
      pair.now += kMillisecond;
      pair.master.axis.advance(1);
      pair.slave.axis.advance(1);
      const Packet<1> packet = other.tick(pair.now, OperatorAct::kNone, 1).packet;
      sleeper.inbox.emplace_back(pair.now + pair.delay, packet);
    }
    pair.now += kMillisecond;
    const Packet<1> packet = sleeper.tick(pair.now, OperatorAct::kNone, 251).packet;
    other.inbox.emplace_back(pair.now + pair.delay, packet);
    pair.run(4000);
    EXPECT_EQ(pair.resumed, 0);
    EXPECT_EQ(pair.master.state(), S::kHolding);
    EXPECT_EQ(pair.slave.state(), S::kHolding);
  }
}

TYPED_TEST(Resumes, ThreeTimesAMinuteThenAnOperator) {
  Resuming<TypeParam> pair;
  pair.engage();
  for (int k = 0; k < 5; ++k) {
    pair.lose(true, true, 200);
    pair.run(2000);
    EXPECT_EQ(pair.engaged(), k < 3) << k;
  }
  EXPECT_EQ(pair.resumed, 3);
  pair.act = OperatorAct::kEngage;
  pair.run(3000);
  EXPECT_TRUE(pair.engaged()) << "by the operator's act";
  pair.lose(true, true, 200);
  pair.run(2000);
  EXPECT_EQ(pair.resumed, 3) << "an act makes the minute no shorter";
  pair.run(60'000);
  pair.act = OperatorAct::kEngage;
  pair.run(3000);
  pair.lose(true, true, 200);
  pair.run(2000);
  EXPECT_EQ(pair.resumed, 4);
  EXPECT_TRUE(pair.engaged());
}

// Somebody on the way who cuts the line in a rhythm: the hand is taken by the operator once and by resumption three
// times in any minute.
TYPED_TEST(Resumes, WhoCutsTheLineInARhythmGetsTheHandThreeTimes) {
  struct Rhythm {
    int lost_ms, carried_ms;
    bool forward, backward;
  };
  for (const Rhythm& rhythm : {Rhythm{90, 110, true, true},
                               {110, 90, true, true},
                               {110, 90, true, false},
                               {110, 90, false, true},
                               {130, 470, true, true},
                               {200, 700, true, true},
                               {105, 1000, false, true},
                               {480, 1500, true, true}}) {
    Resuming<TypeParam> pair;
    pair.engage();
    pair.taken.clear();
    for (int ms = 0; ms < 100'000; ms += rhythm.lost_ms + rhythm.carried_ms) {
      pair.lose(rhythm.forward, rhythm.backward, rhythm.lost_ms);
      pair.run(rhythm.carried_ms);
    }
    std::printf("%d of %d ms lost: the hand is taken %zu times in 100 s\n", rhythm.lost_ms,
                rhythm.lost_ms + rhythm.carried_ms, pair.taken.size());
    EXPECT_LE(pair.most_in_a_minute(), 3u);
    EXPECT_LE(pair.taken.size(), 3u) << "once it is held, an operator is needed";
  }
}

}  // namespace
}  // namespace farhand
