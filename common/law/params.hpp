// The settings of every architecture. They are apart from the laws, so that code that only fills them is not rebuilt
// when a law is edited.
#pragma once

#include "common/signal/cutoff.hpp"

namespace farhand {

struct FourChannelGains {
  double K_p = 400.0;  // 1/s2
  double K_d = 40.0;   // 1/s
  double K_f = 250.0;  // 1/(kg m2); at most 1/J_n, or hits on a wall may not die out
};

inline constexpr double kOnPurpose = 8.0;  // rad/s: faster components of a motion are taken as involuntary

enum class LocalModel { kThesis, kWithForce };

struct SdcvParams {
  double f_1 = 0.35;  // N m
  double f_2 = 0.75;  // N m, above f_1
  Cutoff alpha_cutoff = Cutoff::rad_s(5.0);
  bool from_patient = false;  // then f_1 and f_2 are start values (common/law/patient_thresholds.hpp)
};

struct TwoChannelParams {
  double K_2 = 5.0;      // N m/rad, holds the master to the slave's angle
  double B_2 = 0.05;     // N m s/rad
  double B_slave = 0.1;  // N m s/rad, damps the slave
};

// Which ends of the wave line have matched impedance and reflect nothing.
enum class Matching { kNone, kSlave, kBoth };

struct WaveParams {
  double b = 0.2;      // N m s/rad, the line's own impedance
  double K_s = 5.0;    // N m/rad, holds the slave to the angle that its wave asks for
  double B_s = 0.2;    // N m s/rad
  double drift = 0.0;  // 1/s, rate at which that angle drifts towards the master's
  Matching matching = Matching::kNone;
};

struct TankParams {
  double level = 0.05;  // J, desired
  double alpha = 20.0;  // N m s/rad per J below the level: damper that fills the therapist's tank
  double rate = 10.0;   // 1/s, share of the energy in the tank that is sent
  double B_fast = 0.1;  // N m s/rad, on the involuntary part of the therapist's motion
};

struct LawParams {
  Cutoff g_net = Cutoff::rad_s(1000.0);
  LocalModel local_model = LocalModel::kThesis;
  SdcvParams sdcv;
  TwoChannelParams two_channel;
  WaveParams wave;
  TankParams tank;
};

// 1/s, largest rate of a damper on the inertia 1/K_f, because the velocity is known 7 ms late.
inline constexpr double kFastestDamper = 100.0;

}  // namespace farhand
