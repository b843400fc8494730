// The settings of every architecture, apart from the code that they set.
#pragma once

#include "common/control/params.hpp"

namespace farhand {

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
