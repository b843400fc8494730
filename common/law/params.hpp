// The settings of every architecture, apart from the code that they set: what only sets them is not rebuilt when one is
// edited.
#pragma once

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
  bool from_patient = false;  // f_1 and f_2 are where the patient's own begin (common/law/patient_thresholds.hpp)
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

struct LawParams {
  Cutoff g_net = Cutoff::rad_s(1000.0);
  LocalModel local_model = LocalModel::kThesis;
  SdcvParams sdcv;
  TwoChannelParams two_channel;
  WaveParams wave;
  TankParams tank;
};

// 1/s, of a damper with the inertia 1/K_f: the velocity is known 7 ms late.
inline constexpr double kFastestDamper = 100.0;

}  // namespace farhand
