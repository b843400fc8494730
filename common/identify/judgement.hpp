// Is what was identified the axis that the scene describes, or one that this model does not describe at all?
#pragma once

#include "common/identify/free_motion.hpp"
#include "common/identify/misfit.hpp"
#include "common/identify/spring.hpp"
#include "common/observer/axis_model.hpp"

namespace farhand {

// What is plausible. A factor of 2 is what a mistaken unit, gear or torque constant exceeds; J_n may be up to 1.3 times
// J before the loop shakes (observer/axis_model.hpp), and a scene that is off by less than 2 is to be mended, not
// doubted.
struct Plausible {
  double factor = 2.0;           // J, D, F_c, spring: the scene's over this, and times this,
  double viscous_room = 0.01;    // N m s/rad, and this more; a tenth of it less
  double coulomb_room = 0.05;    // N m
  double stiffness_room = 0.05;  // N m/rad by which P may be another; the softest hand has 0.5
  double torque_room = 0.05;     // N m by which Q may be
  double weight_share = 0.25;    // of the scene's weight, both besides
  // Left of the torque, RMS: beyond both it is no noise of the encoder, and another plant.
  double residual_share = 0.02;    // of the torque
  double residual_expected = 4.0;  // times what rounding leaves; an encoder may be noisy by a count
  // Half of an interval, at most:
  double uncertain_share = 0.1;      // of J and of the spring
  double uncertain_viscous = 0.005;  // N m s/rad
  double uncertain_coulomb = 0.01;   // N m
};

Misfit misfit(const FreeMotionEstimate& found, const AxisModel& said, const Plausible& plausible = {}) noexcept;
// said: N m/rad.
Misfit misfit(const SpringEstimate& found, double said, const Plausible& plausible = {}) noexcept;

// Where a known inertia stands behind what was identified, the motor gives this many times the torque that the nominal
// K_tn says: K_tn times this is its true constant, and J, D, F_c times this are the true ones.
Estimate torque_scale(const Estimate& J, double known_J) noexcept;
// The same from two runs, the second with an inertia added that is known; the axis' own need not be.
Estimate torque_scale(const Estimate& J, const Estimate& J_with, double added_J) noexcept;

}  // namespace farhand
