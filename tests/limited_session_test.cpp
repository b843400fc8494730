// Each limit of the patient's box reached in a whole session in virtual time: the peak at the simulated hand, the
// warning before, what the therapist's side is told, and what no packet can change.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "common/config/station_params.hpp"
#include "common/link/codec.hpp"
#include "common/runtime/owned_station.hpp"
#include "common/show/figures.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

// Into a hand of 5 N m/rad within half a second, and stay: up to 0.9 rad/s, 12 rad/s2 and 1 N m.
constexpr const char* kScene = R"(
architecture: FOUR_CHANNEL
duration_s: 12
control { K_f_per_kgm2: 125 }
master { therapist { grip: FIRM
  intended { duration_s: 2 } intended { duration_s: 0.5 ramp_to_rad: 0.25 } intended { duration_s: 20 } } }
slave { hand { stiffness_nm_per_rad: 5 } }
network { forward { delay_s: 0.01 distribution: CONSTANT } backward { delay_s: 0.01 distribution: CONSTANT } }
operator_acts { at_s: 0.2 act: ENGAGE }
)";

class Limited final : public Witness {
 public:
  explicit Limited(std::vector<std::string> sets, bool elastic) {
    if (elastic) sets.push_back("slave.device=SERIES_ELASTIC");
    const LoadedScene loaded = load_scene_text(kScene, "limited", sets);
    simulate(loaded, make_sides(loaded.scene), *this);
  }

  void ticked(bool master, const Side& side, double t_s, OperatorAct /*act*/) override {
    if (master) {
      told |= side.receiver().newest().limits;
      return;
    }
    const TickTrace<1>& trace = side.trace();
    const Truth truth = side.truth();
    rows.push_back({t_s, trace.state, trace.reason, trace.limits, truth.x, truth.v, truth.f});
  }

  struct Row {
    double t_s;
    StationState state;
    Reason reason;
    std::uint32_t limits;
    double x, v, f;
  };
  template <class F>
  double peak(F value, double from_s = 0) const {
    double most = 0;
    for (const Row& row : rows) {
      if (row.t_s >= from_s) most = std::max(most, value(row));
    }
    return most;
  }
  // Over 20 ms: the counts of the encoder are felt in less.
  double peak_acceleration() const {
    double most = 0;
    for (std::size_t k = 20; k < rows.size(); ++k) most = std::max(most, std::abs(rows[k].v - rows[k - 20].v) / 0.02);
    return most;
  }
  double first(std::uint32_t bits) const {
    for (const Row& row : rows) {
      if ((row.limits & bits) != 0) return row.t_s;
    }
    return 1e9;
  }
  // Warned before it acted or in the tick after, and the therapist's side was told of both.
  void expect_said(LimitBit bit) const {
    const std::uint32_t near = static_cast<std::uint32_t>(bit) << kWarningShift;
    EXPECT_LT(first(bit), 1e9) << bit;
    EXPECT_LE(first(near), first(bit) + 1.5e-3) << bit;
    EXPECT_EQ(told & bit, bit);
    EXPECT_EQ(told & near, near);
  }

  std::vector<Row> rows;
  std::uint32_t told = 0;
};

double angle(const Limited::Row& row) { return row.x; }
double speed(const Limited::Row& row) { return std::abs(row.v); }
double torque(const Limited::Row& row) { return std::abs(row.f); }
double power(const Limited::Row& row) { return row.f * row.v; }

std::string set(const char* field, double value) { return std::string(field) + "=" + std::to_string(value); }

class OnEitherDevice : public ::testing::TestWithParam<bool> {
 public:
  void print(const char* what, double reached, double limit, double free) const {
    std::printf("  %-14s %-13s %8.4f at a limit of %g, %.4f without\n", GetParam() ? "series-elastic" : "direct", what,
                reached, limit, free);
  }
  const Limited& free() const {
    static const Limited runs[] = {Limited({}, false), Limited({}, true)};
    return runs[GetParam()];
  }
};
INSTANTIATE_TEST_SUITE_P(Limits, OnEitherDevice, ::testing::Bool(),
                         [](const auto& device) { return device.param ? "SeriesElastic" : "Direct"; });

TEST_P(OnEitherDevice, DefaultsLeaveAnOrdinarySessionAlone) {
  for (const Limited::Row& row : free().rows) ASSERT_EQ(row.limits & kLimits, 0u) << row.t_s;
  EXPECT_GT(free().peak(torque), 0.4);
}

// The hand's inertia and spring: what still moves at v when the limit is reached presses on with v sqrt(k J), and goes
// on by v sqrt(J / k).
double press_on(const Limited& run) { return run.peak(speed) * std::sqrt(5 * 4e-3); }

TEST_P(OnEitherDevice, Position) {
  const Limited run({set("slave.axis.range_max_rad", 0.1)}, GetParam());
  print("angle, rad", run.peak(angle), 0.1, free().peak(angle));
  run.expect_said(kLimitRange);
  // Behind the MCU it is the law that stops: critically damped at sqrt(K_p) = 20 rad/s, from v on by v / (20 e).
  const double goes_on = GetParam() ? run.peak(speed) / (20 * std::numbers::e) : press_on(run) / 5;
  EXPECT_LE(run.peak(angle), 0.1 + goes_on);
  EXPECT_LE(run.peak(angle, 4), 0.1 + 1e-3);
}

// A torque ends at the limit like a low-pass, known 3 ms late: a tenth. Behind the MCU it is the reference that is
// limited, and what the forces differ by adds K_f/K_d of it, 3 rad/s per N m: a quarter of the limit is 30 mN m.
TEST_P(OnEitherDevice, Velocity) {
  const Limited run({set("slave.axis.velocity_limit_rad_s", 0.4)}, GetParam());
  print("speed, rad/s", run.peak(speed), 0.4, free().peak(speed));
  run.expect_said(kLimitVelocity);
  EXPECT_LE(run.peak(speed), (GetParam() ? 1.25 : 1.1) * 0.4);
  EXPECT_GT(free().peak(speed), 0.55);
}

TEST_P(OnEitherDevice, Acceleration) {
  const Limited run({set("slave.axis.acceleration_limit_rad_s2", 2)}, GetParam());
  print("accel., rad/s2", run.peak_acceleration(), 2, free().peak_acceleration());
  run.expect_said(kLimitAcceleration);
  EXPECT_LT(run.peak_acceleration(), free().peak_acceleration());
}

TEST_P(OnEitherDevice, Torque) {
  const Limited run({set("slave.axis.torque_limit_nm", 0.3)}, GetParam());
  print("torque, N m", run.peak(torque), 0.3, free().peak(torque));
  run.expect_said(kLimitTorque);
  EXPECT_LE(run.peak(torque), 0.3 + press_on(run));
  EXPECT_LE(run.peak(torque, 6), 0.3 + 5e-3);
}

// Power is known one lag of the observer late, and behind the MCU by the line's as well; it grows that long. (The MCU
// keeps it by itself, before the station sees any, and tells so.)
TEST_P(OnEitherDevice, Power) {
  const double lag_s = GetParam() ? 1 / 100.0 + 2 * 0.0015 + 0.003 : 1 / 200.0 + 0.002;
  double slope = 0;
  const auto& rows = free().rows;
  for (std::size_t k = 10; k < rows.size(); ++k) slope = std::max(slope, (power(rows[k]) - power(rows[k - 10])) / 0.01);
  for (const double limit : {0.05, 0.1, 0.2}) {
    const Limited run({set("slave.limits.power_w", limit)}, GetParam());
    print("power, W", run.peak(power), limit, free().peak(power));
    run.expect_said(GetParam() ? kLimitDevice : kLimitPower);
    EXPECT_LE(run.peak(power), limit + lag_s * slope) << slope;
  }
}

// Exercise into hands of any stiffness, under limits of power that it reaches in every turn: the hand comes back at the
// speed at which it does without a limit, and nothing leaves it within a tick.
TEST(LimitedExercise, NobodyIsLetGoByACountOfTheEncoder) {
  const auto run = [](const char* stiffness, const std::string& power) {
    const std::vector<std::string> sets = {
        "duration_s=20",
        "master.therapist={grip: FIRM intended {duration_s: 2} "
        "intended {duration_s: 17 sine_amplitude_rad: 0.34 sine_frequency_hz: 1}}",
        std::string("slave.hand={stiffness_nm_per_rad: ") + stiffness + "}",
        "network={forward {delay_s: 0.02 distribution: CONSTANT} backward {delay_s: 0.02 distribution: CONSTANT}}",
        "windows={free {from_s: 4 until_s: 8} contact {from_s: 10 until_s: 20}}",
        "slave.limits.power_w=" + power};
    return simulate(load_scene("four_channel_mediated", sets));
  };
  const auto back = [](const Session& session) {  // rad/s
    double most = 0;
    for (const StationSample& row : session.slave) {
      if (row.true_v_rad_s * row.true_f_nm < 0) most = std::max(most, std::abs(row.true_v_rad_s));
    }
    return most;
  };
  for (const char* stiffness : {"5", "10", "15", "20"}) {
    const double without = back(run(stiffness, "1000"));
    for (const char* power : {"0.3", "0.5", "0.7"}) {
      const Session session = run(stiffness, power);
      double fell = 0;
      for (std::size_t k = 3000; k < session.slave.size(); ++k)
        fell = std::max(fell, std::abs(session.slave[k].command_nm - session.slave[k - 1].command_nm));
      std::printf("%s N m/rad, %s W: back at %.2f rad/s (%.2f without a limit), command by %.2f N m in a tick\n",
                  stiffness, power, back(session), without, fell);
      EXPECT_LE(back(session), 1.25 * without) << stiffness << " N m/rad, " << power << " W";
      EXPECT_LE(fell, 0.3) << stiffness << " N m/rad, " << power << " W";
    }
  }
}

// Warns, holds, lets the hand go.
TEST_P(OnEitherDevice, EnergyWarmthAndTimeHoldThenLetGo) {
  for (const auto& [what, sets] :
       {std::pair(kLimitEnergy, std::vector{set("slave.limits.energy_j_per_min", 0.06)}),
        std::pair(kLimitHeat, std::vector{set("slave.limits.motor_continuous_a", GetParam() ? 0.2 : 2),
                                          set("slave.limits.motor_overload_s", 3)}),
        std::pair(kLimitSession, std::vector{set("slave.limits.session_s", 4)})}) {
    const Limited run(sets, GetParam());
    run.expect_said(what);
    const double holds = run.first(what);
    std::printf("  %-14s limit %4x: near from %.3f s, holds from %.3f s\n", GetParam() ? "series-elastic" : "direct",
                what, run.first(what << kWarningShift), holds);
    EXPECT_LT(run.first(what << kWarningShift), holds);
    for (const Limited::Row& row : run.rows) {
      if (row.t_s < holds - 1e-9) continue;
      ASSERT_EQ(row.state, StationState::kHolding);
      ASSERT_EQ(row.reason, Reason::kPatientLimit);
    }
    EXPECT_LT(run.peak(torque, holds + 3.0 + 0.5 + 0.5), 0.02);  // N m; waiting, fading, and the hand's swing
  }
}

// No packet has a word for a limit; whatever one says, what leaves the box stays within what the box's scene says.
template <class Io, class Check>
void attack(const char* device, Check check) {
  const LoadedScene loaded = load_scene_text(
      kScene, "limited",
      std::vector{std::string("slave.device=") + device, std::string("slave.limits.motor_continuous_a=1000")});
  OwnedStation<Io> station(slave_station_params(loaded.scene, 2));
  std::mt19937_64 bits(31);
  PacketCodec<1> codec;
  typename Io::Sensed sensed;
  sensed.valid = true;
  int engaged = 0;
  for (std::uint32_t k = 1; k <= 30'000; ++k) {
    const Nanoseconds now = k * kMillisecond;
    Packet<1> packet;
    packet.session = 1;
    packet.seq = k;
    packet.send_time_ns = now;
    packet.state = k % 5000 < 1000 ? StationState::kAligning : StationState::kEngaged;
    packet.motion.x[0] = sensed.x[0];
    if (k % 5000 > 1500 && uniform(bits, 0, 1) < 0.5) {  // anything that the codec lets through
      packet.limits = static_cast<std::uint32_t>(bits()) & kAllLimits;
      packet.expiry_ms = static_cast<std::uint32_t>(bits());
      packet.motion = {Joints<1>(uniform(bits, -1e3, 1e3)), Joints<1>(uniform(bits, -1e6, 1e6)),
                       Joints<1>(uniform(bits, -1e6, 1e6))};
    }
    Packet<1> received;
    if (codec.decode(codec.encode(packet), received) == DecodeResult::kOk) station.receive(received, now);
    sensed.x[0] += 1e-3 * uniform(bits, -1, 1) - 1e-3 * sensed.x[0];
    const auto out = station.tick(now, sensed);
    engaged += station.trace().state == StationState::kEngaged;
    ASSERT_NO_FATAL_FAILURE(check(out.command, loaded.scene.slave().axis()));
  }
  EXPECT_GT(engaged, 15'000);
}

TEST(PatientsBox, NoPacketMovesALimitOfTheTorque) {
  double last = 0;
  attack<DirectIo<1>>("DIRECT_DRIVE", [&](const DirectIo<1>::Command& command, const scene::Axis& axis) {
    ASSERT_LE(std::abs(command.torque[0]), axis.torque_limit_nm());
    ASSERT_LE(std::abs(command.torque[0] - last), axis.torque_rate_limit_nm_per_s() * 1e-3 * (1 + 1e-12));
    last = command.torque[0];
  });
}

TEST(PatientsBox, NoPacketMovesALimitOfTheReference) {
  Motion<1> last;
  double speed = 0;
  bool tracked = false;
  attack<ReferenceIo<1>>("SERIES_ELASTIC", [&](const ReferenceIo<1>::Command& command, const scene::Axis& axis) {
    const Motion<1>& to = command.reference;
    const double moves = (to.x[0] - last.x[0]) / 1e-3, a = axis.acceleration_limit_rad_s2();
    if (command.track && tracked) {
      ASSERT_LE(std::abs(moves), axis.velocity_limit_rad_s() + 1e-9);
      ASSERT_LE(std::abs(moves - speed), a * 1e-3 + 1e-9);
      ASSERT_LE(std::abs(to.v[0] - last.v[0]), a * 1e-3 + 1e-9);
    }
    ASSERT_LE(std::abs(to.x[0]), axis.range_max_rad());
    ASSERT_LE(std::abs(to.v[0]), axis.velocity_limit_rad_s());
    ASSERT_LE(std::abs(to.f[0]), axis.torque_limit_nm());
    speed = command.track && tracked ? moves : 0.0;
    tracked = command.track;
    last = to;
  });
}

TEST(PatientsBox, ImpossibleLimitsAreRefused) {
  for (const char* set :
       {"slave.limits.power_w=0", "slave.limits.energy_j_per_min=-1", "slave.limits.session_s=0",
        "slave.limits.motor_continuous_a=0", "slave.limits.motor_overload=1", "slave.limits.motor_overload_s=nan",
        "slave.limits.surface_limit_c=61", "slave.limits.soft_start_s=0", "slave.axis.acceleration_limit_rad_s2=0"}) {
    EXPECT_THROW(load_scene_text(kScene, "limited", std::vector{std::string(set)}), ConfigError) << set;
  }
  const std::vector<std::string> warm_room{"slave.limits.room_c=38", "slave.limits.surface_limit_c=37"};
  EXPECT_THROW(load_scene_text(kScene, "limited", warm_room), ConfigError);
}

}  // namespace
}  // namespace farhand
