// The settings of an identification, apart from the estimator, because most stations never identify anything.
#pragma once

#include "common/identify/sweeps.hpp"

namespace farhand {

struct IdentifyingParams {
  SweepsParams sweeps;
  double torque = 0.5;             // N m, at most
  double resolution = 3.14159e-4;  // rad, a count of the encoder
};

}  // namespace farhand
