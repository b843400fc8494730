// The meaning of a genome: the world of a session, and the packets of the peer in it.
#pragma once

#include <array>

#include "common/link/packet.hpp"
#include "netem/lab/rogue_genome.hpp"

namespace farhand::rogue {

// The person and the device, within what the acceptance names.
struct WorldPlan {
  double stiffness, damping;  // N m/rad, N m s/rad, of the hand or of the therapist's arm
  double spastic;             // N m s/rad
  double J_factor;            // true inertia over the nominal one
  double motor_speed_limit;   // rad/s, behind an MCU
  double counts_per_rev;      // of every encoder
  double frozen_from_s;       // the encoder stands for 5 ms; < 0: never
};

enum class Shape : std::uint8_t {
  kConstant,
  kSquare,
  kSine,
  kChirp,
  kEdge,
  kRamp,
  kNoise,
  kPulse,
  kWithSpeed,
  kWithAngle,
  kWithTorque,
  kHold,
  kCount
};
enum class Base : std::uint8_t { kZero, kNow, kAtStart, kMirror, kCount };

// One quantity in the peer's packets: base + amplitude * shape.
struct Channel {
  Shape shape;
  Base base;
  double amplitude, hz, phase;
  int lag;  // ticks by which the state of the hand that it is switched on is older
};

enum class Until : std::uint8_t { kTime, kTurns, kFast, kFar, kPressed, kCount };
enum class Numbers : std::uint8_t { kInOrder, kRepeats, kJumps, kBackwards, kNewSession, kCount };
enum class Stamps : std::uint8_t { kRight, kFastClock, kSlowClock, kAhead, kJumps, kSame, kCount };
enum class Echoes : std::uint8_t { kRight, kNone, kWrongSession, kFuture, kLong, kCount };
enum class Rhythm : std::uint8_t { kEveryTick, kGaps, kBursts, kSparse, kDouble, kCount };

struct Segment {
  double duration_s;
  Until until;
  StationState state, other;  // flaps between them
  double flap_hz;             // 0: does not
  Channel x, v, f;
  bool velocity_of_x;  // v is the derivative of x
  Rhythm rhythm;
  double gap_s;
  Numbers numbers;
  Stamps stamps;
  Echoes echoes;
  double stamp_by;  // s, or s/s
  double energy_w;  // W, rise of the sum of energy
};

struct LastWord {
  bool any;
  double x, v, f;
  StationState state;
  int packets;
};

// Errors of a lying telemetry channel.
struct Lies {
  double from_s, until_s;  // after the engagement
  double angle, angle_hz;  // rad
  bool angle_frozen, torque_frozen;
  double torque, torque_hz;  // N m
  double torque_factor;
  int state;  // -1: the true one
  int page;   // -1: the true ones
  std::uint8_t page_value;
  double to_pc_s, to_mcu_s;  // how much later than it should
  bool creeping;             // the delays grow over a second
  bool seq_lies;
};

struct Plan {
  WorldPlan world;
  bool legal;            // every value stays within the limits of the side that is lied to
  double engage_offset;  // rad from the hand, by which the peer engages
  double network_s;
  int attack_from;  // 0: engaged, 1: as soon as it wants to engage, 2: at once
  bool engages_again;
  bool claims_gaps;  // whoever holds, or has it hold, does so for a gap of the network, and now that is over
  bool repeats;      // the segments begin anew after the last one
  double attack_s;   // from the first engagement to the last packet
  bool falls_silent;
  LastWord last;
  Lies lies;
  std::array<Segment, kSegments> segments;
};

enum class Against : std::uint8_t { kPatient, kTherapist };

Plan plan_of(const Genome& genome, Against against);

}  // namespace farhand::rogue
