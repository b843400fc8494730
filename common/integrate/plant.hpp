// The interface of a plant to an integrator. Plants are piecewise smooth: within a mode (which contacts are closed, in
// which direction friction slides, whether it sticks) the derivative is smooth, and the mode ends when one of its
// guards falls below zero. The derivative of a mode stays smooth a little beyond its end, so that a step may overshoot
// and be cut at the guard; this keeps the order of a method across contacts.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

namespace farhand {

using Mode = std::uint32_t;  // bits that only the plant can read

template <std::size_t kStates>
using StateMatrix = std::array<std::array<double, kStates>, kStates>;  // row by row

// Every input that is held between control ticks (torque, velocity command) is part of the plant object.
//
// A plant may also have  bool keeps_clear(mode, from, to, h)  which is true only if no guard can fall below zero in a
// step of length h between these states. The guards are then not evaluated.
template <class P>
concept Plant = requires(const P& plant, double t, const typename P::State& x, typename P::State& reset, Mode mode,
                         std::size_t guard) {
  requires std::same_as<typename P::State, std::array<double, P::kStates>>;
  { P::kGuards } -> std::convertible_to<std::size_t>;

  // The mode that the state is in, or enters if it lies on the border.
  { plant.mode_at(t, x) }
  noexcept->std::same_as<Mode>;
  { plant.derivative(mode, t, x) }
  noexcept->std::same_as<typename P::State>;
  // Derivatives by the state, and by the time.
  { plant.jacobian(mode, t, x) }
  noexcept->std::same_as<StateMatrix<P::kStates>>;
  { plant.time_derivative(mode, t, x) }
  noexcept->std::same_as<typename P::State>;
  // All at least zero while the mode holds.
  { plant.guards(mode, t, x) }
  noexcept->std::same_as<std::array<double, P::kGuards>>;
  // The mode that follows when `guard` has fallen to zero; may change the state (a velocity becomes 0 where friction
  // sticks).
  { plant.cross(mode, guard, t, reset) }
  noexcept->std::same_as<Mode>;
  // The first time after t at which the derivative is not smooth in time (a movement ends, a hand is put in); +inf if
  // none.
  { plant.next_break(t) }
  noexcept->std::same_as<double>;
};

}  // namespace farhand
