// The settings of the laws, apart from the laws: what only sets them is not rebuilt when one is edited.
#pragma once

#include <limits>

#include "common/signal/cutoff.hpp"

namespace farhand {

struct FourChannelGains {
  double K_p = 400.0;  // 1/s2
  double K_d = 40.0;   // 1/s
  double K_f = 250.0;  // 1/(kg m2); at most 1/J_n, or hits on a wall may not die out
};

inline constexpr double kOnPurpose = 8.0;  // rad/s: what of a person's motion is faster is not meant

enum class LocalModel { kThesis, kWithForce };

struct SdcvParams {
  double f_1 = 0.35;  // N m
  double f_2 = 0.75;  // N m, above f_1
  Cutoff alpha_cutoff = Cutoff::rad_s(5.0);
  bool from_patient = false;  // f_1 and f_2 are where the patient's own begin (common/control/patient_thresholds.hpp)
};

struct TwoChannelParams {
  double K_2 = 5.0;      // N m/rad, of the master to the slave's angle
  double B_2 = 0.05;     // N m s/rad
  double B_slave = 0.1;  // N m s/rad, damps the slave
};

// Which ends of the wave's line reflect nothing.
enum class Matching { kNone, kSlave, kBoth };

struct WaveParams {
  double b = 0.2;      // N m s/rad, the line's own impedance
  double K_s = 5.0;    // N m/rad, of the slave to where its wave says
  double B_s = 0.2;    // N m s/rad
  double drift = 0.0;  // 1/s, by which that place drifts towards the master's
  Matching matching = Matching::kNone;
};

struct TankParams {
  double level = 0.05;  // J, desired
  double alpha = 20.0;  // N m s/rad per J that is missing: fills the therapist's tank
  double rate = 10.0;   // 1/s, of the level that is sent
  double B_fast = 0.1;  // N m s/rad, on what of the therapist's motion is faster than on purpose
};

struct GateParams {
  double torque = 3.0;          // N m
  double torque_rate = 3000.0;  // N m/s
  double velocity = 4.0;        // rad/s, of a reference
  double range_min = -0.349;    // rad
  double range_max = 0.349;
  double acceleration = std::numeric_limits<double>::infinity();  // rad/s2, asked for
};

// What is taken of what a peer says (common/control/intake.hpp), in the size of this side.
struct IntakeParams {
  double torque = 3.0;        // N m
  double velocity = 4.0;      // rad/s
  double range_min = -0.349;  // rad
  double range_max = 0.349;
  double wave = 0.0;  // sqrt(W), where the integral of a wave stands in the torque's place; 0: it does not
};

// What an axis may do to the person in it while it is driven (common/control/person_bound.hpp).
struct PersonBoundParams {
  double speed = std::numeric_limits<double>::infinity();  // rad/s
  double power = std::numeric_limits<double>::infinity();  // W, given to the person
  bool free = false;                                       // what the person does himself is left alone, however fast
};

}  // namespace farhand
