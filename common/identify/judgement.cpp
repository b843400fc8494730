#include "common/identify/judgement.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {
namespace {

bool another_plant(double residual, double expected, double torque, const Plausible& p) noexcept {
  return residual > p.residual_expected * expected && residual > p.residual_share * torque;
}

bool within(double found, double said, double room, const Plausible& p) noexcept {
  return found >= said / p.factor - 0.1 * room && found <= said * p.factor + room;
}

}  // namespace

Misfit misfit(const FreeMotionEstimate& found, const AxisModel& said, const Plausible& p) noexcept {
  if (!found.determined) return Misfit::kTooLittleMotion;
  const double P = said.gravity * std::cos(said.gravity_angle), Q = said.gravity * std::sin(said.gravity_angle);
  const double weight = p.weight_share * said.gravity;
  if (std::abs(found.P.value - P) > std::max(p.stiffness_room + weight, found.P.half_width) ||
      std::abs(found.Q.value - Q) > std::max(p.torque_room + weight, found.Q.half_width))
    return Misfit::kHeld;
  if (another_plant(found.residual, found.expected, found.torque, p)) return Misfit::kAnotherPlant;
  if (!(found.J.half_width <= p.uncertain_share * std::abs(found.J.value)) ||
      !(found.viscous.half_width <= p.uncertain_viscous) || !(found.coulomb.half_width <= p.uncertain_coulomb))
    return Misfit::kUncertain;
  if (!within(found.J.value, said.J_n, 0.0, p)) return Misfit::kInertia;
  // Friction that drives is none.
  const auto drives = [](const Estimate& e, double room) { return e.value + e.half_width < -0.1 * room; };
  if (!within(found.viscous.value, said.viscous, p.viscous_room, p) || drives(found.viscous, p.viscous_room))
    return Misfit::kViscous;
  if (!within(found.coulomb.value, said.coulomb, p.coulomb_room, p) || drives(found.coulomb, p.coulomb_room))
    return Misfit::kCoulomb;
  return Misfit::kNone;
}

Misfit misfit(const SpringEstimate& found, double said, const Plausible& p) noexcept {
  if (!found.determined) return Misfit::kTooLittleMotion;
  if (another_plant(found.residual, found.expected, found.torque, p)) return Misfit::kAnotherPlant;
  if (!(found.k.half_width <= p.uncertain_share * std::abs(found.k.value))) return Misfit::kUncertain;
  return within(found.k.value, said, 0.0, p) ? Misfit::kNone : Misfit::kSpring;
}

const char* name_of(Misfit misfit) noexcept {
  constexpr const char* kNames[] = {
      "it is as the scene says",
      "it moved too little, or too much alike, to tell its parameters apart",
      "the intervals are too wide: it needs to be moved for longer",
      "what is left of the torque is no noise: a hand, backlash, another friction, or something touched now and then",
      "a spring, weight or constant torque that the scene does not know acts on it: a hand in the device?",
      "its inertia is not within half and twice the scene's",
      "its viscous friction is not what the scene says",
      "its Coulomb friction is not what the scene says",
      "its spring is not within half and twice the scene's"};
  return kNames[static_cast<int>(misfit)];
}

Estimate torque_scale(const Estimate& J, double known_J) noexcept {
  const double scale = known_J / J.value;
  return {scale, scale * J.half_width / J.value};
}

Estimate torque_scale(const Estimate& J, const Estimate& J_with, double added_J) noexcept {
  const double difference = J_with.value - J.value, scale = added_J / difference;
  return {scale, std::abs(scale / difference) * std::hypot(J.half_width, J_with.half_width)};
}

}  // namespace farhand
