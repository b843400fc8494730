// How fast does everybody let go when somebody falls silent? In virtual time, so that the promised times are asserted
// to the tick: master, slave and emulated MCU from the pieces of the programs, with a network, a cable and a slave
// process that can fail. (The MCU's own watchdog alone is in mcu_core_test.cpp.)
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <deque>

#include "common/config/load.hpp"
#include "common/config/station_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/simulation.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

constexpr Nanoseconds kDelay = 100 * kMillisecond;  // of the network, each way
constexpr Nanoseconds kSerial = 1'500'000;          // of the cable, each way: the scene's default

// The orthosis, and what of its cable still works.
struct Orthosis {
  explicit Orthosis(const scene::Scene& scene) : on_serial(emulator_params(scene), to_seconds(kSerial)) {}

  OrthosisOnSerial on_serial;
  bool from_mcu = true, to_mcu = true, plugged = true;
};

// The station's end of it, as McuAxis takes a port.
class FailingCable {
 public:
  explicit FailingCable(Orthosis& orthosis) : orthosis_(orthosis) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    const Nanoseconds now = from_seconds(t_s);
    orthosis_.on_serial.advance(now);
    std::size_t count = 0;
    while (count < bytes.size() && orthosis_.on_serial.receive(now, bytes[count])) ++count;
    return orthosis_.from_mcu && orthosis_.plugged ? count : 0;
  }
  bool write(std::span<const std::uint8_t> bytes, double t_s) noexcept {
    if (orthosis_.to_mcu && orthosis_.plugged) orthosis_.on_serial.send(bytes.data(), bytes.size(), from_seconds(t_s));
    return orthosis_.plugged;
  }
  void drop_unsent(double t_s) noexcept { orthosis_.on_serial.drop_unsent(from_seconds(t_s)); }
  bool lost() noexcept { return !orthosis_.plugged; }

 private:
  Orthosis& orthosis_;
};

class Sides {
 public:
  Sides() : Sides(load_scene("sea_four_channel_cdob_sdcv").scene) {}

  bool forward = true, backward = true;  // what is sent now will arrive
  bool slave_runs = true;

  Orthosis orthosis;
  std::unique_ptr<Side> master, slave;
  Nanoseconds now = -kMillisecond;  // of the tick that was last
  Nanoseconds master_heard = 0, slave_heard = 0;

  void tick(OperatorAct act = OperatorAct::kNone) {
    now += kMillisecond;
    for (; !to_slave_.empty() && to_slave_.front().first <= now; to_slave_.pop_front()) {
      slave_heard = to_slave_.front().first;
      slave->receive(to_slave_.front().second, slave_heard);
    }
    for (; !to_master_.empty() && to_master_.front().first <= now; to_master_.pop_front()) {
      master_heard = to_master_.front().first;
      master->receive(to_master_.front().second, master_heard);
    }
    const Packet<1> from_master = master->tick(now, to_seconds(now), act, 1);
    if (forward) to_slave_.emplace_back(now + kDelay, from_master);
    if (slave_runs) {
      const Packet<1> from_slave = slave->tick(now, to_seconds(now), OperatorAct::kNone, 1);
      if (backward) to_master_.emplace_back(now + kDelay, from_slave);
    } else {
      orthosis.on_serial.advance(now);
    }
  }

  // Engaged, and the hand is pressed.
  void work() {
    while (now < 2 * kSecond) tick(now == kSecond ? OperatorAct::kEngage : OperatorAct::kNone);
    while (now < 25 * kSecond && std::abs(torque_on_hand()) < 0.5) tick();
    ASSERT_EQ(master->trace().state, StationState::kEngaged);
    ASSERT_EQ(slave->trace().state, StationState::kEngaged);
    ASSERT_GE(std::abs(torque_on_hand()), 0.5);
  }

  // The tick at which the station got there; -1 if it did not within two seconds.
  Nanoseconds until(const Side& side, StationState state) {
    for (const Nanoseconds end = now + 2 * kSecond; now < end;) {
      tick();
      if (side.trace().state == state) return now;
    }
    return -1;
  }

  const OrthosisEmulator& emulator() const { return orthosis.on_serial.emulator(); }
  double torque_on_hand() const { return emulator().world().true_f(); }

 private:
  explicit Sides(const scene::Scene& scene)
      : orthosis(scene),
        master(make_simulated_master(scene, 1)),
        slave(std::make_unique<SideOf<McuAxis<FailingCable>>>(slave_station_params(scene, 2), orthosis)) {}

  std::deque<std::pair<Nanoseconds, Packet<1>>> to_slave_, to_master_;
};

// Silence is longer than 100 ms for the first time 101 ms after the last packet.
TEST(Reaction, SilenceOfTheNetworkHoldsTheSlaveAt100MillisecondsAndATick) {
  Sides sides;
  sides.work();
  sides.forward = false;
  const Nanoseconds held = sides.until(*sides.slave, StationState::kHolding);
  EXPECT_EQ(held - sides.slave_heard, 101 * kMillisecond);
  EXPECT_EQ(sides.slave->trace().reason, Reason::kPeerSilent);
  // The way back is whole, so the master learns of it one delay later.
  EXPECT_EQ(sides.until(*sides.master, StationState::kHolding), held + kDelay);
  EXPECT_EQ(sides.master->trace().reason, Reason::kPeerDeaf);
}

TEST(Reaction, SilenceOfTheNetworkHoldsTheMasterAt100MillisecondsAndATick) {
  Sides sides;
  sides.work();
  sides.backward = false;
  const Nanoseconds held = sides.until(*sides.master, StationState::kHolding);
  EXPECT_EQ(held - sides.master_heard, 101 * kMillisecond);
  EXPECT_EQ(sides.master->trace().reason, Reason::kPeerSilent);
  EXPECT_EQ(sides.until(*sides.slave, StationState::kHolding), held + kDelay);
  EXPECT_EQ(sides.slave->trace().reason, Reason::kPeerDeaf);
}

// The last frame from before the silence arrives up to the cable's delay later.
TEST(Reaction, SilenceOfTheSerialLineLetsGoAt50MillisecondsAndATick) {
  Sides sides;
  sides.work();
  const Nanoseconds heard = sides.now;  // telemetry comes every tick
  sides.orthosis.from_mcu = false;
  const Nanoseconds let_go = sides.until(*sides.slave, StationState::kOff);
  EXPECT_GE(let_go - heard, 50 * kMillisecond);
  EXPECT_LE(let_go - heard, 51 * kMillisecond);
  EXPECT_EQ(sides.slave->trace().reason, Reason::kDeviceLost);
  EXPECT_EQ(sides.until(*sides.master, StationState::kHolding), let_go + kDelay);
  EXPECT_EQ(sides.master->trace().reason, Reason::kPeerLetGo);
}

// The MCU hears that it is to let go, and ramps down in 50 ms, although it cannot be heard.
TEST(Reaction, AnMcuThatIsNotHeardIsToldToLetGo) {
  Sides sides;
  sides.work();
  sides.orthosis.from_mcu = false;
  const Nanoseconds let_go = sides.until(*sides.slave, StationState::kOff);
  while (sides.emulator().output().state != mcu::State::kSafe && sides.now < let_go + kSecond) sides.tick();
  EXPECT_LE(sides.now - let_go, kSerial + 50 * kMillisecond + 2 * kMillisecond);
}

TEST(Reaction, AnUnpluggedCableLetsGoInTheSameTick) {
  Sides sides;
  sides.work();
  const Nanoseconds pulled = sides.now;
  sides.orthosis.plugged = false;
  EXPECT_EQ(sides.until(*sides.slave, StationState::kOff), pulled + kMillisecond);
  EXPECT_EQ(sides.slave->trace().reason, Reason::kDeviceLost);
}

// 20 ms without a frame and 50 ms of ramp, counted from the arrival of the last frame. What the spring then still shows
// is the ramp's lag, gone with the spring loop's 10 ms, and the motor's lag behind a hand that springs back freely.
void expect_torque_off_the_hand(Sides& sides, Nanoseconds last_word) {
  const auto spring = [&] { return std::abs(sides.emulator().world().truth().spring_torque); };
  const double pressed = spring();
  while (sides.now < last_word + 20 * kMillisecond) sides.tick();
  EXPECT_GE(spring(), 0.9 * pressed) << "a late frame alone is no reason";
  while (sides.emulator().output().state != mcu::State::kSafe && sides.now < last_word + kSecond) sides.tick();
  const Nanoseconds safe = sides.now;
  std::printf("SAFE %.1f ms after the last frame was sent\n", 1e3 * to_seconds(safe - last_word));
  EXPECT_LE(safe - last_word, kSerial + 70 * kMillisecond + kMillisecond);
  while (sides.now < safe + kSecond) {
    sides.tick();
    if (sides.now > safe + 30 * kMillisecond) {
      ASSERT_LE(spring(), 0.2 * pressed);
    }
  }
}

TEST(Reaction, WithTheSlaveProcessDeadTheMcuTakesTheTorqueOffTheHand) {
  Sides sides;
  sides.work();
  sides.slave_runs = false;
  expect_torque_off_the_hand(sides, sides.now);
}

TEST(Reaction, AnMcuThatHearsNothingLetsGoAndTheSlaveNoticesThatItDid) {
  Sides sides;
  sides.work();
  const Nanoseconds last_word = sides.now;
  sides.orthosis.to_mcu = false;
  expect_torque_off_the_hand(sides, last_word);
  // Its telemetry came all the time, but on a line that brings no command nothing is tested.
  EXPECT_EQ(sides.slave->trace().state, StationState::kSelfTest);
  EXPECT_EQ(sides.slave->trace().reason, Reason::kDeviceFound);
}

// One frame and 2 ms after the press there is no torque, with the network, without it and without the slave's process.
// The slave hears of it from the next telemetry, the master one delay later. What the patient released goes on only
// when the operator engages.
TEST(Reaction, ThePatientsStopTakesTheTorqueOffWithinThreeMillisecondsAndOnlyThePatientEndsIt) {
  for (const int down : {0, 1, 2}) {
    Sides sides;
    sides.work();
    sides.forward = sides.backward = down != 1;
    sides.slave_runs = down != 2;
    OrthosisEmulator& orthosis = sides.orthosis.on_serial.emulator();
    const Nanoseconds pressed = sides.now;
    const double held = std::abs(sides.torque_on_hand());
    orthosis.press_stop(true);
    while (orthosis.core().torque_command() != 0 && sides.now < pressed + kSecond) sides.tick();
    EXPECT_LE(sides.now - pressed, 3 * kMillisecond) << down;
    if (down == 0) {
      EXPECT_LE(sides.until(*sides.slave, StationState::kOff) - pressed, 4 * kMillisecond);
      EXPECT_EQ(sides.slave->trace().reason, Reason::kDeviceLost);
      EXPECT_LE(sides.until(*sides.master, StationState::kHolding) - pressed, 4 * kMillisecond + kDelay);
    }
    while (sides.now < pressed + kSecond) sides.tick();
    // Let go, the hand swings on its own spring (5 N m/rad, 4e-3 kg m2) and rests by its own damping, 0.022 N m s/rad.
    EXPECT_LE(std::abs(sides.torque_on_hand()), held * std::exp(-0.022 / (2 * 4e-3)));
    orthosis.press_stop(false);
    while (sides.now < pressed + 2 * kSecond) sides.tick();
    EXPECT_EQ(orthosis.output().state, mcu::State::kFault);
    orthosis.press_release(true);
    while (sides.now < pressed + 3 * kSecond) sides.tick();
    EXPECT_EQ(orthosis.core().faults(), 0);
    EXPECT_EQ(orthosis.output().state, mcu::State::kSafe);
    EXPECT_EQ(orthosis.core().torque_command(), 0);
  }
}

// The outage of the shipped scene, on both kinds of slave, judged on every tick in which a station drives its axis.
class Recovery : public testing::TestWithParam<std::vector<std::string>> {};
INSTANTIATE_TEST_SUITE_P(Outage, Recovery,
                         testing::Values(std::vector<std::string>{},
                                         std::vector<std::string>{"slave.device=SERIES_ELASTIC",
                                                                  "control.K_f_per_kgm2=125"}));

double largest_jump(const std::vector<StationSample>& rows) {
  double largest = 0;
  for (std::size_t k = 2; k < rows.size(); ++k) {
    if (asks_of(static_cast<StationState>(rows[k].state)) != Asks::kMotion) continue;
    const double ahead = 2 * rows[k - 1].target_x_rad - rows[k - 2].target_x_rad;
    largest = std::max(largest, std::abs(rows[k].target_x_rad - ahead));
  }
  return largest;
}

TEST_P(Recovery, BringsTrackingBackWithoutAJump) {
  const LoadedScene loaded = load_scene("outage", GetParam());
  const Session session = simulate(loaded);
  const auto holding = static_cast<int>(StationState::kHolding), engaged = static_cast<int>(StationState::kEngaged);
  const auto row_at = [](const std::vector<StationSample>& rows, double t_s) {
    return rows[static_cast<std::size_t>(std::lround(1000 * t_s))];
  };
  for (const double t_s : {12.8, 17.0, 23.9}) {  // through the outage and until the operator's act
    EXPECT_EQ(row_at(session.master, t_s).state, holding);
    EXPECT_EQ(row_at(session.slave, t_s).state, holding);
  }
  // From when on the hand is where the therapist's was one play-out ago, for good.
  const double act_s = loaded.scene.operator_acts(1).at_s();
  double since_s = 0, worst = 0;
  for (const StationSample& row : session.slave) {
    if (row.t_s < act_s) continue;
    const double error = std::abs(row.x_rad - row.remote_x_rad);
    if (row.state != engaged || error > 0.01) since_s = 0;
    if (row.state == engaged && error <= 0.01 && since_s == 0) since_s = row.t_s;
    if (row.t_s > act_s + 3) worst = std::max(worst, error);
  }
  std::printf("tracking is back %.3f s after the act, worst 3 s after it %.2f mrad; largest jump %.3f and %.3f mrad\n",
              since_s - act_s, 1e3 * worst, 1e3 * largest_jump(session.master), 1e3 * largest_jump(session.slave));
  EXPECT_GT(since_s, 0);
  EXPECT_LE(since_s, act_s + 3);
  EXPECT_LE(largest_jump(session.master), 1e-3);
  EXPECT_LE(largest_jump(session.slave), 1e-3);
}

}  // namespace
}  // namespace farhand
