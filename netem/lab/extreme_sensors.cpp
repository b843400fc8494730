// Readings that are no numbers, or no angles that a joint can have, from each sensor: who notices first, and that
// nothing of it reaches an actuator.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/config/schema.hpp"
#include "common/device/mcu_si.hpp"
#include "common/runtime/owned_station.hpp"
#include "netem/lab/extreme_families.hpp"
#include "slave/mcu/mcu_params.hpp"

namespace farhand::extreme {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
const char* const kFamily = "NaN and Inf from each sensor";

std::string word(double value) { return std::isnan(value) ? "NaN" : value > 0 ? "Inf" : "-Inf"; }

void add_encoders(Cases& cases) {
  for (const bool on_master : {true, false}) {
    for (const double wrong : {kNan, kInf, -kInf}) {
      SessionPlan plan;
      plan.meter_s = 25e-6;  // without its motor the arm swings to a stop
      plan.energy_within = 1e-3;
      const auto once = [wrong](double t_s, double reading) { return t_s > 5 && t_s < 5.0015 ? wrong : reading; };
      (on_master ? plan.master_encoder : plan.slave_encoder) = once;
      const std::string who = on_master ? "master" : "slave";
      cases.push_back(session_case(kFamily, "encoder of the " + who + ": " + word(wrong) + " for one tick",
                                   refused(who + " fault: reading is not a number", Block::kEncoder), plan));
    }
  }
}

// Letters that carry what is no number, with a checksum that is right.
Case letter_case(const std::string& name, double wrong, int which, std::uint64_t every, Expected expected) {
  return {kFamily, name, std::move(expected), [=] {
            SessionPlan plan;
            PacketCodec<1> codec;
            std::uint64_t count = 0;
            plan.sets = {"duration_s=9"};
            plan.to_slave = plan.to_master = [&](const Letter& letter) {
              Letter out = letter;
              Packet<1> packet;
              if (++count % every == 0 && codec.decode(letter.bytes, packet) == DecodeResult::kOk) {
                (which == 0 ? packet.motion.x : which == 1 ? packet.motion.v : packet.motion.f)[0] = wrong;
                std::ranges::copy(codec.encode(packet), out.bytes.begin());
              }
              return std::vector<Letter>{out};
            };
            return judge_session(run_session(plan));
          }};
}

void add_letters(Cases& cases) {
  const char* const names[] = {"angle", "velocity", "torque"};
  for (int which = 0; which < 3; ++which) {
    for (const double wrong : {kNan, kInf}) {
      Expected expected = accurate(1e-9);
      expected.first_bad = Block::kLink;
      cases.push_back(letter_case(std::string("packets: every third ") + names[which] + " is " + word(wrong), wrong,
                                  which, 3, expected));
    }
  }
  cases.push_back(letter_case("packets: every angle is NaN", kNan, 0, 1, refused("ready: tested", Block::kLink)));
}

// A station on an axis with a torque sensor: telemetry that is no number.
Case telemetry_case(const std::string& name, double x, double f) {
  return {kFamily, name, refused("fault: reading is not a number", Block::kEncoder), [=] {
            StationParams params;
            params.role = Role::kFollower;
            params.receive = {.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
            OwnedStation<ReferenceIo<1>> station(params);
            ReferenceIo<1>::Sensed sensed{.x = Joints<1>(0.1), .f = Joints<1>(0.0), .valid = true};
            Watch watch;
            Packet<1> leader{.session = 7, .motion = {}};
            leader.motion.x[0] = 0.1;
            Outcome out;
            bool tracked = false, let_go = true;
            for (Nanoseconds now = kMillisecond; now < 2 * kSecond; now += kMillisecond, ++out.work) {
              leader.send_time_ns = now;
              ++leader.seq;
              leader.state = now < 1200 * kMillisecond ? StationState::kAligning : StationState::kEngaged;
              station.receive(leader, now);
              sensed.x[0] = now == 1500 * kMillisecond ? x : 0.1;
              sensed.f[0] = now == 1500 * kMillisecond ? f : 0.0;
              watch.see(Block::kEncoder, sensed.x);
              watch.see(Block::kEncoder, sensed.f);
              const auto command = station.tick(now, sensed).command;
              watch.command(command.reference.x[0]);
              watch.command(command.reference.v[0]);
              watch.command(command.reference.f[0]);
              if (now == 1499 * kMillisecond) tracked = command.track;
              if (now >= 1500 * kMillisecond) let_go &= !command.track;
            }
            out.first_bad = watch.first_bad();
            out.bad_at_actuator = watch.bad_at_actuator();
            out.what = std::string("tracked before: ") + (tracked ? "yes" : "no") +
                       "; let go at once and for good: " + (let_go ? "yes" : "no");
            if (tracked && let_go)
              out.refusal =
                  std::string("station ") + name_of(station.trace().state) + ": " + name_of(station.trace().reason);
            return out;
          }};
}

// The core of the MCU takes counts, so that what is wrong there is an angle that no joint can have, or a leap.
Case counts_case(const std::string& name, bool joint, std::int32_t counts, const std::string& fault,
                 const std::string& family = kFamily) {
  return {family, name, refused(fault, Block::kMcu), [=] {
            mcu::OrthosisMcu core(mcu::make_mcu_params({}));
            std::uint8_t seq = 0;
            Outcome out;
            const auto loop = [&](std::int32_t joint_counts, std::int32_t motor_counts, mcu::Mode mode) {
              std::uint8_t wire[mcu::kWireBytes];
              if (out.work % 2 == 0) {
                mcu::encode(mcu::make_command(mode, seq++ & 15, 0, 0, 0), wire);
                for (const std::uint8_t byte : wire) core.receive(byte);
              }
              ++out.work;
              return core.step({joint_counts, motor_counts, 25, false});
            };
            for (int k = 0; k < 10; ++k) loop(0, 0, mcu::Mode::kSafe);
            for (int k = 0; k < 200; ++k) loop(0, 0, mcu::Mode::kTrack);
            const bool tracked = loop(0, 0, mcu::Mode::kTrack).state == mcu::State::kTrack;
            bool stands = true;
            mcu::McuOutput output = loop(joint ? counts : 0, joint ? 0 : counts, mcu::Mode::kTrack);
            for (int k = 0; k < 1000; ++k) {
              stands &= output.motor_velocity == 0 && output.state == mcu::State::kFault;
              output = loop(0, 0, mcu::Mode::kTrack);
            }
            out.first_bad = core.faults() != 0 ? Block::kMcu : Block::kNone;
            out.what = std::string("tracked before: ") + (tracked ? "yes" : "no") +
                       "; stands at once and for good: " + (stands ? "yes" : "no");
            if (tracked && stands) {
              out.refusal = "mcu fault:";
              if (core.faults() & mcu::kJointEncoder) out.refusal += " joint encoder";
              if (core.faults() & mcu::kMotorEncoder) out.refusal += " motor encoder";
              if (core.faults() & mcu::kSpringTorque) out.refusal += " spring torque";
            }
            return out;
          }};
}

}  // namespace

void add_sensors(Cases& cases) {
  add_encoders(cases);
  for (const double wrong : {kNan, kInf}) {
    cases.push_back(telemetry_case("orthosis' angle: " + word(wrong), wrong, 0));
    cases.push_back(telemetry_case("orthosis' torque: " + word(wrong), 0.1, wrong));
  }
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max(),
                         kLeast = std::numeric_limits<std::int32_t>::min();
  cases.push_back(counts_case("joint encoder: largest count", true, kMost, "mcu fault: joint encoder"));
  cases.push_back(counts_case("joint encoder: least count", true, kLeast, "mcu fault: joint encoder"));
  cases.push_back(counts_case("motor encoder: largest count", false, kMost, "mcu fault: motor encoder"));
  cases.push_back(counts_case("motor encoder: least count", false, kLeast, "mcu fault: motor encoder"));
  // An angle just beyond what the MCU takes for one (4 rad), and one that no joint reaches from here within a loop.
  const std::string saturation = "torque, speed and encoder saturation";
  const auto at = [](double angle) {
    return static_cast<std::int32_t>(std::lround(angle / mcu::encoder_unit_rad(20000)));
  };
  cases.push_back(counts_case("joint encoder at 4.01 rad", true, at(4.01), "mcu fault: joint encoder", saturation));
  cases.push_back(counts_case("joint encoder at -4.01 rad", true, at(-4.01), "mcu fault: joint encoder", saturation));
  cases.push_back(counts_case("motor encoder at 4.01 rad", false, at(4.01), "mcu fault: motor encoder", saturation));
  cases.push_back(counts_case("joint encoder leaps by 1 rad", true, at(1.0), "mcu fault: joint encoder", saturation));
  add_letters(cases);
}

}  // namespace farhand::extreme
