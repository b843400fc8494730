// Decides whether the identified axis is the one of the scene, and whether the model describes it at all.
#pragma once

#include "common/identify/free_motion.hpp"
#include "common/identify/misfit.hpp"
#include "common/identify/spring.hpp"
#include "common/observer/axis_model.hpp"

namespace farhand {

// The bands of agreement. A mistaken unit, gear or torque constant causes more than a factor of 2. J_n may be up to 1.3
// times J before the loop oscillates (observer/axis_model.hpp). A scene that is wrong by less than a factor of 2 needs
// a correction; its axis is the right one.
struct Plausible {
  double factor = 2.0;           // J, D, F_c, spring: from the scene's value over this to that times this,
  double viscous_room = 0.01;    // N m s/rad, with this added above, and a tenth of it below
  double coulomb_room = 0.05;    // N m
  double stiffness_room = 0.05;  // N m/rad by which P may differ; the softest hand has 0.5
  double torque_room = 0.05;     // N m by which Q may differ
  double weight_share = 0.25;    // share of the scene's weight that both may differ in addition
  // Residual torque, RMS: beyond both bounds it is not noise of the encoder; the plant is another one.
  double residual_share = 0.02;    // of the torque
  double residual_expected = 4.0;  // times the residual of rounding; an encoder may have noise of a count
  // Largest half width of an interval:
  double uncertain_share = 0.1;      // of J and of the spring
  double uncertain_viscous = 0.005;  // N m s/rad
  double uncertain_coulomb = 0.01;   // N m
};

Misfit misfit(const FreeMotionEstimate& found, const AxisModel& said, const Plausible& plausible = {}) noexcept;
// said: the scene's value, N m/rad.
Misfit misfit(const SpringEstimate& found, double said, const Plausible& plausible = {}) noexcept;

// The scale of the torque, for an axis whose true inertia is known: the motor gives this many times the torque of its
// nominal K_tn. K_tn times this is its true constant, and J, D, F_c times this are the true values.
Estimate torque_scale(const Estimate& J, double known_J) noexcept;
// The same from two runs, the second with a known inertia added; the axis' own inertia need not be known.
Estimate torque_scale(const Estimate& J, const Estimate& J_with, double added_J) noexcept;

}  // namespace farhand
