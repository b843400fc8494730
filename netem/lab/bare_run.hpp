// A bare loop behind one interface, for any scene, integrator, step or tolerance.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "proto/scene.pb.h"

namespace farhand {

enum class BareMethod : std::uint8_t {
  kSemiImplicitEuler,
  kRk4,
  kSdirk2,
  kRosenbrock,
  kAdaptive,
  kClosedForm,
  kCvodeBdf,
  kCvodeAdams,
  kClosedFormLong,  // long double, law and plant
  kWorld,           // the method that the scene asks for
};

constexpr std::string_view name_of(BareMethod method) {
  constexpr std::array<std::string_view, 10> kNames{
      SemiImplicitEuler::kName,     Rk4::kName,  Sdirk2::kName, Rosenbrock::kName,          DormandPrince::kName,
      name_of(Method::kClosedForm), "CVODE BDF", "CVODE Adams", "closed form, long double", "scene's own"};
  return kNames[static_cast<std::size_t>(method)];
}
// Order of convergence in the step; 0 if the method has no step.
constexpr int order_of(BareMethod method) {
  constexpr std::array<int, 10> kOrders{
      SemiImplicitEuler::kOrder, Rk4::kOrder, Sdirk2::kOrder, Rosenbrock::kOrder, DormandPrince::kOrder, 0, 0, 0, 0, 0};
  return kOrders[static_cast<std::size_t>(method)];
}
constexpr bool takes_a_tolerance(BareMethod method) {
  return method == BareMethod::kAdaptive || method == BareMethod::kCvodeBdf || method == BareMethod::kCvodeAdams;
}
constexpr bool takes_a_step(BareMethod method) { return method < BareMethod::kAdaptive; }

struct BareChoice {
  BareMethod method = BareMethod::kClosedForm;
  double step_s = 0;  // where the method takes one
  double rtol = 0;    // relative tolerance, where it takes one; the absolute one is a hundredth of it

  bool operator==(const BareChoice&) const = default;
};

// At the end of each tick; the truth of the plants, not what encoders read.
struct Trajectory {
  std::vector<double> x_m, x_s, f_m, f_s;  // rad, N m
  std::string failure;                     // sentence of a solver that did not reach the end
  std::uint64_t steps = 0, events = 0;     // of both sides
};

class BareRun {
 public:
  virtual ~BareRun() = default;
  // Runs only the loop.
  virtual void run(std::int64_t ticks) noexcept = 0;
  virtual Trajectory record(std::int64_t ticks) = 0;
};

// The scene must be complete, as load_scene returns it. ideal: encoders read the true angles. Throws
// std::invalid_argument with the reason if the method cannot propagate the scene.
std::unique_ptr<BareRun> make_bare_run(const scene::Scene& scene, const BareChoice& choice, bool ideal = true);

// The integrators of the scene's two worlds, as text.
std::string methods_of(const scene::Scene& scene);

// Why the closed form cannot propagate it; empty if it can.
std::string not_affine(const scene::Scene& scene);

// The longest time for which an input of a plant is held.
double hold_of(const scene::Scene& scene);
inline std::int64_t ticks_of(const scene::Scene& scene) {
  return static_cast<std::int64_t>(scene.duration_s() / scene.tick_s() + 0.5);
}

}  // namespace farhand
