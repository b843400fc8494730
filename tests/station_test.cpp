// Stations in pairs, with an axis under each and delay between them: what they do when something goes wrong, and that
// nothing jumps when they take hold, let go or lose each other.
#include "common/scene/station.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <set>

#include "common/control/four_channel.hpp"

namespace farhand {
namespace {

using S = StationState;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// A motor axis in a hand: a spring to where that hand wants to be, and some damping.
struct AxisInHand {
  double stiffness = 0.5;
  Joints<1> rest = Joints<1>::Zero();
  Joints<1> x = Joints<1>::Zero(), v = Joints<1>::Zero(), torque = Joints<1>::Zero();

  void advance(int milliseconds) {
    for (int k = 0; k < 20 * milliseconds; ++k) {
      v += 5e-5 * (torque + stiffness * (rest - x) - 0.05 * v) / 4e-3;
      x += 5e-5 * v;
    }
  }
};

// An axis that closes its own loop: it follows the reference within 20 ms, lets go within 50 ms, and shows as reaction
// what the hand's spring does.
struct AxisBehindMcu {
  double stiffness = 0.5;
  Joints<1> rest = Joints<1>::Zero();
  Joints<1> x = Joints<1>::Zero();
  ReferenceIo<1>::Command command;
  int ramp_ms = 0;

  void advance(int milliseconds) {
    for (int k = 0; k < milliseconds; ++k) {
      ramp_ms = command.track ? 50 : std::max(ramp_ms - 1, 0);
      x += 0.05 * ((command.track ? command.reference.x : rest) - x);
    }
  }
};

template <class Scene>
struct Side {
  explicit Side(Role role, std::uint32_t session = 0) : own{params(role, session)}, station(new Station<Scene>(own)) {}

  static StationParams params(Role role, std::uint32_t session) {
    StationParams p;
    p.role = role;
    p.session = session != 0 ? session : (role == Role::kLeader ? 1u : 2u);
    p.receive = {.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
    return p;
  }
  void restart(std::uint32_t session) {
    own.session = session;
    station.reset(new Station<Scene>(own));
  }

  StationParams own;
  std::unique_ptr<Station<Scene>> station;
  static constexpr bool kDirect = requires(typename Scene::Drive::Command command) { command.torque; };
  std::conditional_t<kDirect, AxisInHand, AxisBehindMcu> axis;
  typename Scene::Drive::Command command;
  typename Scene::Drive::Sensed fault;  // added to the reading
  bool connected = true;                // the device
  std::deque<std::pair<Nanoseconds, Packet<1>>> inbox;

  const TickTrace<1>& trace() const { return station->trace(); }
  S state() const { return station->state(); }

  typename Station<Scene>::Output tick(Nanoseconds now, OperatorAct act, int ticks) {
    while (!inbox.empty() && inbox.front().first <= now) {
      station->receive(inbox.front().second, now);
      inbox.pop_front();
    }
    typename Scene::Drive::Sensed sensed;
    sensed.x = axis.x + fault.x;
    sensed.valid = connected;
    if constexpr (!kDirect) {
      sensed.f = axis.stiffness * (axis.x - axis.rest);
      sensed.at_rest = axis.ramp_ms == 0 && fault.at_rest;
    }
    const auto out = station->tick(now, sensed, act, ticks);
    command = out.command;
    if constexpr (kDirect) {
      axis.torque = command.torque;
    } else {
      axis.command = command;
    }
    return out;
  }
};

template <class Drive>
struct PairOn {
  Side<FourChannelCdobSdcv<Drive>> master{Role::kLeader};
  Side<FourChannel<Drive>> slave{Role::kFollower};
  Nanoseconds now = 0, delay = 30 * kMillisecond;
  bool forward = true, backward = true;  // the link carries
  std::optional<S> lie;                  // what every packet says instead of its sender's state
  OperatorAct act = OperatorAct::kNone, slave_act = OperatorAct::kNone;

  void tick() {
    now += kMillisecond;
    master.axis.advance(1);
    slave.axis.advance(1);
    Packet<1> from_master = master.tick(now, std::exchange(act, OperatorAct::kNone), 1).packet;
    Packet<1> from_slave = slave.tick(now, std::exchange(slave_act, OperatorAct::kNone), 1).packet;
    EXPECT_TRUE(from_master.motion.finite() && from_slave.motion.finite());
    if (lie) from_master.state = from_slave.state = *lie;
    if (forward) slave.inbox.emplace_back(now + delay, from_master);
    if (backward) master.inbox.emplace_back(now + delay, from_slave);
  }
  void run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
  }
  void engage() {
    run(200);
    act = OperatorAct::kEngage;
    run(3000);
    ASSERT_EQ(master.state(), S::kEngaged);
    ASSERT_EQ(slave.state(), S::kEngaged);
  }
};
using Pair = PairOn<DirectDrive<1>>;

TEST(Station, TwoOfThemShareTheirAngles) {
  Pair pair;
  pair.slave.axis.stiffness = 0;
  pair.slave.axis.x.setConstant(0.08);
  pair.engage();
  pair.master.axis.rest.setConstant(-0.15);
  pair.run(5000);
  EXPECT_LT((pair.slave.axis.x - pair.master.axis.x).abs().maxCoeff(), 1e-3);
  EXPECT_LT((pair.slave.axis.x - pair.master.axis.rest).abs().maxCoeff(), 5e-3);
}

TEST(Station, AReadingThatIsNoNumberCutsTheTorqueAtOnceAndForGood) {
  for (const double wrong : {kNan, kInf, -kInf}) {
    for (const bool on_master : {true, false}) {
      Pair pair;
      pair.slave.axis.stiffness = 5;
      pair.engage();
      pair.master.axis.rest.setConstant(0.2);
      pair.run(1000);
      const auto fails = [&](auto& side, auto& peer) {
        ASSERT_GT(side.axis.torque.abs().maxCoeff(), 0.01);
        side.fault.x[0] = wrong;
        pair.tick();
        EXPECT_EQ(side.state(), S::kFault);
        EXPECT_EQ(side.trace().reason, Reason::kNotFinite);
        EXPECT_TRUE(side.trace().limits & kLimitNotFinite);
        EXPECT_TRUE((side.axis.torque == 0.0).all());
        side.fault.x.setZero();  // a good reading does not make up for it, nor does the operator's wish to go on
        for (int k = 0; k < 1000; ++k) {
          pair.act = k == 500 ? OperatorAct::kEngage : OperatorAct::kNone;
          pair.tick();
          ASSERT_EQ(side.state(), S::kFault);
          ASSERT_TRUE((side.axis.torque == 0.0).all());
        }
        EXPECT_EQ(peer.state(), S::kHolding);
        EXPECT_EQ(peer.trace().reason, Reason::kPeerFault);
      };
      if (on_master) {
        fails(pair.master, pair.slave);
        pair.act = OperatorAct::kReset;
        pair.run(1);
        EXPECT_EQ(pair.master.state(), S::kSelfTest);
        pair.run(20);
        EXPECT_EQ(pair.master.state(), S::kReady);
        pair.engage();
      } else {
        fails(pair.slave, pair.master);
      }
    }
  }
}

TEST(Station, AReferenceDriveLetsGoOnAReadingThatIsNoNumber) {
  Station<FourChannel<ReferenceDrive<1>>> station(Side<FourChannel<DirectDrive<1>>>::params(Role::kFollower, 2));
  ReferenceDrive<1>::Sensed sensed{.x = Joints<1>(0.1), .f = Joints<1>(0.0), .valid = true};
  Packet<1> leader;
  leader.session = 1;
  leader.motion.x[0] = 0.1;
  Nanoseconds now = 0;
  const auto tick = [&](S state) {
    now += kMillisecond;
    leader.send_time_ns = now;
    ++leader.seq;
    leader.state = state;
    station.receive(leader, now);
    return station.tick(now, sensed);
  };
  for (int k = 0; k < 1100; ++k) EXPECT_FALSE(tick(S::kAligning).command.track);
  for (int k = 0; k < 50; ++k) EXPECT_TRUE(tick(S::kEngaged).command.track);
  sensed.f[0] = kNan;
  const auto out = tick(S::kEngaged);
  EXPECT_FALSE(out.command.track);
  EXPECT_TRUE(out.command.reference.finite());
  EXPECT_TRUE(out.packet.motion.finite());
  EXPECT_EQ(station.state(), S::kFault);
  sensed.f[0] = 0.0;
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(tick(S::kEngaged).command.track);
}

// Whatever the operator and the network do, the motion to follow goes on where it was. At the tick of a change of state
// it is exactly the one before. Between changes it moves by no more than what it is made of: the own angle, the peer's,
// the compensation (scaled by at most 1), and the fading difference, whose smoothstep is at most 1.5 times as steep as
// the speed of alignment. The torque moves by what the law makes of that.
struct Continuity {
  StationParams params;
  TickTrace<1> last{};
  Joints<1> torque = Joints<1>::Zero();
  bool begun = false;
  int changes = 0;
  double largest_step = 0, largest_torque_step_at_change = 0;

  void see(const TickTrace<1>& now, const Joints<1>& tau) {
    if (asks_of(now.state) == Asks::kNothing) {
      ASSERT_EQ(tau[0], 0.0) << name_of(now.state);  // at once, from whatever it was
      changes += begun && now.state != last.state;
    } else if (begun) {
      const Joints<1> dx = (now.target.x - last.target.x).abs();
      const Joints<1> own = (now.local.x - last.local.x).abs();
      if (now.state != last.state) {
        ++changes;
        ASSERT_LE(dx.maxCoeff(), 1e-9);
        ASSERT_LE((now.target.v - last.target.v).abs().maxCoeff(), 1e-9);
        ASSERT_LE((now.target.f - last.target.f).abs().maxCoeff(), 1e-9);
        largest_torque_step_at_change = std::max(largest_torque_step_at_change, (tau - torque).abs().maxCoeff());
      } else {
        double explained = own.maxCoeff() + (now.remote.x - last.remote.x).abs().maxCoeff() +
                           1.5 * params.align_speed * params.scene.drive.dt_s;
        if (now.state == S::kEngaged) {
          explained += std::abs(now.compensation.x_cdob - last.compensation.x_cdob) +
                       std::abs(now.compensation.alpha - last.compensation.alpha) * std::abs(now.compensation.x_cdob);
        }
        ASSERT_LE(dx.maxCoeff(), explained + 1e-9) << name_of(now.state);
      }
      largest_step = std::max(largest_step, dx.maxCoeff());
      // J_n (C_p, K_f) of what changed, the observer's share, and the part of the law's torque that is handed over per
      // tick.
      const FourChannelGains& K = params.scene.drive.K;
      const AxisModel& model = params.scene.drive.model;
      const auto change = [](const Joints<1>& a, const Joints<1>& b) { return (a - b).abs().maxCoeff(); };
      const double d_x = change(now.target.x, last.target.x) + own.maxCoeff();
      const double d_v = change(now.target.v, last.target.v) + change(now.local.v, last.local.v);
      const double d_f = change(now.target.f, last.target.f) + change(now.local.f, last.local.f);
      const double wish =
          (model.J_n * four_channel(K, now.local, now.target) + now.local.f).abs().maxCoeff() + model.viscous;
      const double explained = model.J_n * (K.K_p * d_x + K.K_d * d_v + K.K_f * d_f) +
                               change(now.local.f, last.local.f) + model.viscous * change(now.local.v, last.local.v) +
                               (params.scene.drive.dt_s / 0.2) * wish;
      ASSERT_LE((tau - torque).abs().maxCoeff(), explained + 1e-9) << name_of(last.state) << name_of(now.state);
    }
    begun = true;
    last = now;
    torque = tau;
  }
};

TEST(Station, NothingJumpsWhateverTheOperatorAndTheNetworkDo) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  int changes = 0, engagements = 0;
  double at_change = 0;
  for (int round = 0; round < 12; ++round) {
    Pair pair;
    pair.delay = static_cast<Nanoseconds>(uniform(0, 150)) * kMillisecond;
    pair.slave.axis.stiffness = uniform(0.2, 5);
    pair.slave.axis.rest[0] = pair.slave.axis.x[0] = uniform(-0.2, 0.2);
    Continuity master{.params = pair.master.own}, slave{.params = pair.slave.own};
    for (int k = 0; k < 20'000; ++k) {
      const std::uint64_t dice = random() % 6000;
      if (dice < 10) pair.act = OperatorAct::kEngage;
      if (dice == 10) pair.act = OperatorAct::kHold;
      if (dice == 11) pair.act = OperatorAct::kStop;
      if (dice >= 40 && dice < 50) pair.act = OperatorAct::kReset;
      if (dice == 12) pair.forward = !pair.forward;
      if (dice == 13) pair.backward = !pair.backward;
      if (dice >= 20 && dice < 30) pair.forward = pair.backward = true;
      if (dice == 31) pair.master.axis.rest[0] = uniform(-0.3, 0.3);
      pair.tick();
      engagements += pair.slave.state() == S::kEngaged && slave.last.state != S::kEngaged;
      ASSERT_NO_FATAL_FAILURE(master.see(pair.master.trace(), pair.master.axis.torque)) << round << ' ' << k;
      ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave.trace(), pair.slave.axis.torque)) << round << ' ' << k;
    }
    changes += master.changes + slave.changes;
    at_change = std::max({at_change, master.largest_torque_step_at_change, slave.largest_torque_step_at_change});
  }
  std::printf("%d changes of state, %d engagements, largest torque step at a change %.3g N m\n", changes, engagements,
              at_change);
  EXPECT_GT(changes, 200);
  EXPECT_GT(engagements, 30);
}

TEST(Station, AStreamThatResumesDoesNotTakeTheHandAgain) {
  Pair pair;
  pair.engage();
  Packet<1> stale;
  stale.session = 1;
  stale.seq = 1'000'000;
  stale.state = S::kEngaged;
  pair.forward = false;
  pair.run(200);
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerSilent);
  for (int k = 0; k < 3000; ++k) {  // as if the leader had never stopped
    ++stale.seq;
    stale.send_time_ns = pair.now;
    pair.slave.inbox.emplace_back(pair.now, stale);
    pair.tick();
    ASSERT_EQ(pair.slave.state(), S::kHolding);
  }
}

// The encoder is not differentiated across a gap: a hand at constant speed keeps its speed.
TEST(Station, MissedTicksMakeNoSpike) {
  for (const double speed : {0.5, -0.5}) {
    for (const int missed : {2, 5, 30}) {
      Station<FourChannel<DirectDrive<1>>> station(Side<FourChannel<DirectDrive<1>>>::params(Role::kLeader, 1));
      Nanoseconds now = 0;
      const auto at = [&](int ticks) {
        now += ticks * kMillisecond;
        DirectDrive<1>::Sensed sensed;
        sensed.x = Joints<1>(speed * to_seconds(now));
        station.tick(now, sensed, OperatorAct::kNone, ticks);
        return station.trace().local;
      };
      for (int k = 0; k < 200; ++k) at(1);
      const Motion<1> before = station.trace().local;
      ASSERT_NEAR(before.v[0], speed, 1e-9);
      for (const int ticks : {missed, 1, 1, 1, missed, 1}) {
        const Motion<1> after = at(ticks);
        EXPECT_NEAR(after.v[0], speed, 1e-9) << missed;
        EXPECT_NEAR(after.f[0], before.f[0], 1e-9) << missed;
      }
    }
  }
}

TEST(Station, SurvivesMissedTicksWhileEngaged) {
  Pair pair;
  pair.slave.axis.stiffness = 0;  // in contact the compensation leaves an offset
  pair.engage();
  pair.master.axis.rest[0] = 0.2;
  pair.run(100);
  const double v = pair.slave.trace().local.v[0];
  ASSERT_GT(std::abs(v), 0.2);
  // The slave's machine stalls for 30 ms; its motor holds the last torque.
  pair.now += 30 * kMillisecond;
  pair.slave.axis.advance(30);
  pair.slave.tick(pair.now, OperatorAct::kNone, 30);
  EXPECT_EQ(pair.slave.state(), S::kEngaged);
  EXPECT_NEAR(pair.slave.trace().local.v[0], v, 1e-9);
  pair.run(3000);
  EXPECT_LT(std::abs(pair.slave.axis.x[0] - pair.master.axis.x[0]), 5e-3);
}

TEST(Station, APeerThatRestartsIsANewPeer) {
  for (const bool restart_master : {true, false}) {
    Pair pair;
    pair.engage();
    pair.master.axis.rest[0] = 0.1;
    pair.run(1000);
    Continuity master{.params = pair.master.own}, slave{.params = pair.slave.own};
    if (restart_master) {
      pair.master.restart(77);
      pair.master.inbox.clear();
    } else {
      pair.slave.restart(78);
      pair.slave.inbox.clear();
    }
    for (int k = 0; k < 1000; ++k) {
      pair.tick();
      if (restart_master) {
        ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave.trace(), pair.slave.axis.torque));
      } else {
        ASSERT_NO_FATAL_FAILURE(master.see(pair.master.trace(), pair.master.axis.torque));
      }
    }
    EXPECT_EQ(pair.master.state(), restart_master ? S::kReady : S::kHolding);
    EXPECT_EQ(pair.slave.state(), S::kReady);  // a leader that is Ready lets the hand go
    EXPECT_EQ(restart_master ? pair.slave.trace().reason : pair.master.trace().reason, Reason::kPeerLetGo);
    pair.engage();
  }
}

TEST(Station, HoldAndStopReachBothSides) {
  Pair pair;
  pair.engage();
  pair.act = OperatorAct::kHold;
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  EXPECT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_EQ(pair.master.trace().reason, Reason::kOperator);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerLetGo);
  pair.engage();
  pair.act = OperatorAct::kStop;
  pair.run(1);
  EXPECT_EQ(pair.master.state(), S::kStopped);
  EXPECT_EQ(pair.master.axis.torque[0], 0.0);
  pair.run(300);  // the other lets go within 0.2 s; without gravity nothing is left
  EXPECT_EQ(pair.slave.state(), S::kReady);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerStopped);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.act = OperatorAct::kEngage;
  pair.run(300);
  EXPECT_EQ(pair.master.state(), S::kStopped);
  pair.act = OperatorAct::kReset;
  pair.engage();
}

TEST(Station, WhatThePatientStoppedTheTherapistCannotStart) {
  Pair pair;
  pair.engage();
  pair.slave_act = OperatorAct::kStop;
  pair.run(1);
  EXPECT_EQ(pair.slave.state(), S::kStopped);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  EXPECT_EQ(pair.master.trace().reason, Reason::kPeerStopped);
  const OperatorAct acts[] = {OperatorAct::kEngage, OperatorAct::kStop, OperatorAct::kReset, OperatorAct::kEngage};
  for (const OperatorAct act : acts) {
    pair.act = act;
    for (int k = 0; k < 1000; ++k) {
      pair.tick();
      ASSERT_EQ(pair.slave.state(), S::kStopped);
      ASSERT_EQ(pair.slave.axis.torque[0], 0.0);
    }
  }
  pair.slave_act = OperatorAct::kReset;
  pair.engage();
}

TEST(Station, ADeviceThatIsLostIsTestedOnceItIsBack) {
  Pair pair;
  pair.engage();
  pair.slave.connected = false;
  pair.run(1);
  EXPECT_EQ(pair.slave.state(), S::kOff);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kDeviceLost);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  pair.slave.axis.x[0] += 0.05;  // moved by hand meanwhile
  pair.slave.axis.rest = pair.slave.axis.x;
  pair.slave.axis.v.setZero();
  pair.slave.connected = true;
  for (int k = 0; k < 500; ++k) {
    pair.tick();
    ASSERT_EQ(pair.slave.state(), k < 20 ? S::kSelfTest : S::kReady);
    ASSERT_LT(std::abs(pair.slave.trace().local.v[0]), 0.01);
    ASSERT_EQ(pair.slave.axis.torque[0], 0.0);
  }
  pair.engage();
}

// What may never be seen of a station, whatever it meets.
template <class Scene>
struct Unsafe {
  static constexpr bool kDirect = Side<Scene>::kDirect;
  S last = S::kOff;
  Joints<1> target = Joints<1>::Zero(), x = Joints<1>::Zero();
  typename Scene::Drive::Command command;
  int ready_ticks = 0;
  double largest_step = 0;  // of what is asked for, on engaging
  std::set<S> seen;

  void see(const Side<Scene>& side, OperatorAct act) {
    const TickTrace<1>& trace = side.trace();
    const S now = trace.state;
    seen.insert(now);
    if (now != last) {
      const auto rows = Engagement::transitions();
      ASSERT_TRUE(std::any_of(rows.begin(), rows.end(),
                              [&](const Transition& row) { return row.from.has(last) && row.to == now; }))
          << name_of(last) << " to " << name_of(now);
      if (last == S::kFault || last == S::kStopped) {
        ASSERT_TRUE(act == OperatorAct::kReset || now == S::kFault);
      }
    }
    ready_ticks = now == S::kReady ? ready_ticks + 1 : 0;
    const bool gives_nothing = asks_of(now) == Asks::kNothing || ready_ticks > 201;
    if constexpr (kDirect) {
      ASSERT_TRUE(std::isfinite(side.command.torque[0]));
      if (gives_nothing) {
        ASSERT_EQ(side.command.torque[0], 0.0) << name_of(now);
      }
      if (now == S::kHoming) {
        ASSERT_LE(std::abs(side.command.torque[0]), 2 * side.own.homing.torque + 1e-12);
      }
    } else {
      ASSERT_TRUE(side.command.reference.finite());
      ASSERT_EQ(side.command.track, asks_of(now) == Asks::kMotion) << name_of(now);
    }
    if (now == S::kEngaged && last != now) {
      double step = std::abs(trace.target.x[0] - target[0]);
      if constexpr (!kDirect) {
        const double before = command.track ? command.reference.x[0] : side.axis.x[0];
        step = std::max(step, std::abs(side.command.reference.x[0] - before));
      }
      ASSERT_LE(step, 1e-3);
      largest_step = std::max(largest_step, step);
    }
    last = now;
    target = trace.target.x;
    command = side.command;
  }
};

// A million ticks of each kind of pair. Every few hundred ticks something happens: acts on either side, a link that
// carries nothing or lies about the states, devices that are pulled, show nonsense or do not come to rest.
template <class Drive>
void expect_nothing_unsafe(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  int engagements = 0;
  double largest_step = 0;
  std::set<S> seen[2];
  for (int round = 0; round < 20; ++round) {
    PairOn<Drive> pair;
    const bool homing = round % 4 == 3;
    if (homing) {
      for (StationParams* own : {&pair.master.own, &pair.slave.own}) {
        own->engagement.homing = true;
        own->homing = {.stop = 0.2, .back = 0.0, .speed = 0.5, .torque = 0.1};
      }
      pair.master.restart(1);
      pair.slave.restart(2);
    }
    pair.delay = static_cast<Nanoseconds>(uniform(0, 80)) * kMillisecond;
    pair.slave.axis.stiffness = uniform(0.2, 5);
    pair.slave.axis.rest[0] = pair.slave.axis.x[0] = uniform(-0.2, 0.2);
    Unsafe<FourChannelCdobSdcv<Drive>> master;
    Unsafe<FourChannel<Drive>> slave;
    const auto fail = [&](auto& side) {
      switch (random() % 5) {
        case 0:
          side.connected = false;
          break;
        case 1:
          side.fault.x[0] = kNan;
          break;
        case 2:
          side.fault.x[0] = 5.0;
          break;
        case 3:
          if constexpr (requires { side.fault.at_rest; }) side.fault.at_rest = false;
          break;
        default:
          side.connected = true;
          side.fault = {};
      }
    };
    for (int k = 0; k < 50'000; ++k) {
      const std::uint64_t dice = random() % 8000;
      if (dice < 40) pair.act = dice < 20 ? OperatorAct::kEngage : dice < 30 ? OperatorAct::kReset : OperatorAct::kHome;
      if (dice >= 40 && dice < 60) pair.slave_act = dice < 50 ? OperatorAct::kReset : OperatorAct::kHome;
      if (dice == 60) pair.act = static_cast<OperatorAct>(random() % 6);
      if (dice == 61) pair.slave_act = static_cast<OperatorAct>(random() % 6);
      if (dice == 62) pair.forward = false;
      if (dice == 63) pair.backward = false;
      if (dice == 64) pair.lie = static_cast<S>(random() % 9);
      if (dice == 65) fail(pair.master);
      if (dice == 66) fail(pair.slave);
      if (dice == 67) pair.master.axis.rest[0] = uniform(-0.3, 0.3);
      if (dice >= 70 && dice < 80) pair.forward = pair.backward = true;
      if (dice >= 75 && dice < 80) pair.lie.reset();
      if (dice >= 80 && dice < 90) {
        pair.master.connected = pair.slave.connected = true;
        pair.master.fault = pair.slave.fault = {};
      }
      const OperatorAct act = pair.act, slave_act = pair.slave_act;
      pair.tick();
      engagements += pair.slave.state() == S::kEngaged && slave.last != S::kEngaged;
      ASSERT_NO_FATAL_FAILURE(master.see(pair.master, act)) << "master, " << round << ' ' << k;
      ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave, slave_act)) << "slave, " << round << ' ' << k;
    }
    largest_step = std::max({largest_step, master.largest_step, slave.largest_step});
    seen[0].merge(master.seen);
    seen[1].merge(slave.seen);
  }
  std::printf("%d engagements of the slave, largest step on engaging %.2g mrad\n", engagements, 1e3 * largest_step);
  EXPECT_GT(engagements, 100);
  EXPECT_EQ(seen[0].size(), 9u);
  EXPECT_EQ(seen[1].size(), 8u);  // the follower never aligns
}

TEST(Station, NothingUnsafeWhateverHappens) {
  expect_nothing_unsafe<DirectDrive<1>>(21);
  expect_nothing_unsafe<ReferenceDrive<1>>(22);
}

// A hand that takes the device 10 degrees away from where it holds: the spring of K_p/K_f asks for no more than
// 0.28 N m, with the velocity that it is pulled at, K_d/K_f v besides.
TEST(Station, APatientPullsAwayFromHoldingAgainstAFractionOfANewtonMetre) {
  Pair pair;
  pair.slave.axis.stiffness = 200;  // a hand that goes where it wants
  pair.engage();
  pair.forward = pair.backward = false;
  pair.run(700);
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_NEAR(pair.slave.trace().target.v[0], 0.0, 1e-12) << "what moved has come to rest";
  const FourChannelGains& K = pair.slave.own.scene.drive.K;
  const double start = pair.slave.axis.x[0], speed = 0.35, away = 10 * 0.0174533;
  double largest = 0;
  for (int k = 0; k < 3000; ++k) {
    pair.slave.axis.rest[0] = start + std::min(speed * 1e-3 * k, away);
    pair.tick();
    largest = std::max(largest, std::abs(pair.slave.axis.torque[0]));
  }
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_NEAR(pair.slave.axis.x[0], start + away, 2e-3);
  const double steady = std::abs(pair.slave.axis.torque[0]), spring = K.K_p / K.K_f * away;
  std::printf("10 degrees away: %.3f N m at rest, %.3f N m on the way\n", steady, largest);
  EXPECT_LE(steady, 1.02 * spring);
  EXPECT_LE(largest, spring + 1.2 * K.K_d / K.K_f * speed);
}

// An encoder that counts from where it was switched on, and a stop at 0.3 rad.
struct Lost {
  explicit Lost(double start) {
    StationParams p = Side<FourChannel<DirectDrive<1>>>::params(Role::kFollower, 2);
    p.engagement.homing = true;
    p.engagement.homing_timeout = 15 * kSecond;
    p.homing = {.stop = 0.3, .back = -0.1, .speed = 0.2, .torque = 0.15};
    station.emplace(p);
    counted_from = x = start;
  }
  double counted_from, x, v = 0, torque = 0, stop_min = -0.3, largest = 0, fastest = 0;
  double stop_max = 0.3;
  bool connected = true;
  std::optional<Station<FourChannel<DirectDrive<1>>>> station;
  Nanoseconds now = 0;

  void run(int ticks, OperatorAct act = OperatorAct::kNone) {
    for (int k = 0; k < ticks; ++k) {
      now += kMillisecond;
      for (int i = 0; i < 50; ++i) {
        const double stop = 3000 * (std::max(x - stop_max, 0.0) + std::min(x - stop_min, 0.0));
        const double damping = stop != 0 ? 3.0 : 0.005;
        v += 2e-5 * (torque - stop - damping * v) / 4e-3;
        x += 2e-5 * v;
      }
      DirectDrive<1>::Sensed sensed;
      sensed.x[0] = x - counted_from;
      sensed.valid = connected;
      torque = station->tick(now, sensed, k == 0 ? act : OperatorAct::kNone).command.torque[0];
      if (station->state() == S::kHoming) {
        largest = std::max(largest, std::abs(torque));
        fastest = std::max(fastest, std::abs(v));
      }
    }
  }
};

TEST(Station, HomingFindsTheZeroSlowlyAndSoftlyFromAnywhere) {
  for (const double start : {-0.29, -0.1, 0.0, 0.15, 0.3}) {
    Lost lost(start);
    lost.run(2000);
    ASSERT_EQ(lost.station->state(), S::kSelfTest) << "it waits for `home`";
    ASSERT_EQ(lost.torque, 0.0);
    lost.run(9000, OperatorAct::kHome);
    ASSERT_EQ(lost.station->state(), S::kReady) << name_of(lost.station->trace().reason);
    EXPECT_EQ(lost.station->trace().reason, Reason::kHomed);
    EXPECT_NEAR(lost.station->trace().local.x[0], lost.x, 2e-3) << "what it believes is so";
    EXPECT_NEAR(lost.x, -0.1, 0.0175 + 2e-3);
    EXPECT_LE(lost.largest, 0.3 + 1e-12);
    EXPECT_LE(lost.fastest, 0.4);
    std::printf("from %5.2f rad: wrong by %.2g mrad, at most %.3f N m and %.2f rad/s\n", start,
                1e3 * (lost.station->trace().local.x[0] - lost.x), lost.largest, lost.fastest);
  }
}

TEST(Station, HomingEndsInAFaultThatSaysWhy) {
  const auto ends = [](auto&& disturb, Reason reason) {
    Lost lost(0.0);
    lost.run(100);
    lost.run(500, OperatorAct::kHome);
    ASSERT_EQ(lost.station->state(), S::kHoming);
    disturb(lost);
    EXPECT_EQ(lost.station->state(), S::kFault);
    EXPECT_EQ(lost.station->trace().reason, reason);
    EXPECT_EQ(lost.torque, 0.0);
    lost.connected = true;
    lost.run(100, OperatorAct::kReset);
    EXPECT_EQ(lost.station->state(), S::kSelfTest) << "its angle is still not known";
  };
  ends([](Lost& lost) { lost.run(1, OperatorAct::kHold); }, Reason::kOperator);
  ends(
      [](Lost& lost) {
        lost.connected = false;
        lost.run(1);
      },
      Reason::kDeviceLost);
  ends(
      [](Lost& lost) {
        lost.stop_max = 1e9;
        lost.run(16'000);
      },
      Reason::kTimeout);
  ends(
      [](Lost& lost) {  // something is in the way back
        lost.run(2500);
        lost.stop_min = lost.x - 0.02;
        lost.run(8000);
      },
      Reason::kBlocked);
}

}  // namespace
}  // namespace farhand
