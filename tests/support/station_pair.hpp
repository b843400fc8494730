// Two stations with an axis under each and delay between them, for tests of what stations do together.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/runtime/owned_station.hpp"

namespace farhand {

using S = StationState;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

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

// Plain four channels at the patient, with CDOB and SDCV at the therapist.
template <class Io>
struct Side {
  explicit Side(Role role, std::uint32_t session = 0)
      : own{params(role, session)}, station(new OwnedStation<Io>(own)) {}

  static StationParams params(Role role, std::uint32_t session) {
    StationParams p;
    p.role = role;
    if (role == Role::kLeader) p.architecture = "FOUR_CHANNEL_CDOB_SDCV";
    p.session = session != 0 ? session : (role == Role::kLeader ? 1u : 2u);
    p.receive = {.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
    p.guard.limits.continuous_a = p.guard.limits.energy_j = 1e9;  // these walks overheat and overwork what is real
    return p;
  }
  void restart(std::uint32_t session) {
    own.session = session;
    station.reset(new OwnedStation<Io>(own));
  }

  StationParams own;
  std::unique_ptr<OwnedStation<Io>> station;
  static constexpr bool kDirect = requires(typename Io::Command command) { command.torque; };
  std::conditional_t<kDirect, AxisInHand, AxisBehindMcu> axis;
  typename Io::Command command;
  typename Io::Sensed fault;  // added to the reading
  bool connected = true;      // the device
  std::deque<std::pair<Nanoseconds, Packet<1>>> inbox;

  const TickTrace<1>& trace() const { return station->trace(); }
  S state() const { return station->state(); }

  typename Station<Io>::Output tick(Nanoseconds now, OperatorAct act, int ticks) {
    while (!inbox.empty() && inbox.front().first <= now) {
      station->receive(inbox.front().second, now);
      inbox.pop_front();
    }
    typename Io::Sensed sensed;
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

template <class Io>
struct PairOn {
  Side<Io> master{Role::kLeader};
  Side<Io> slave{Role::kFollower};
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
using Pair = PairOn<DirectIo<1>>;

}  // namespace farhand
